"""Display colours for the classic renderer, which supports neither sRGB nor a tone curve."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.response import encode_srgb
from gear.contracts.rendering import has_own_colour

SHADOW_REACH_M = 50.0
"""Half the side of the square in front of the camera in which the sun casts shadows, metres."""

SHADOW_MAP_PX = 2048
"""Side of the shadow map in texels; a texel covers five centimetres. With twice as many texels, a frame would take a
tenth more time.
"""

LIFT = 2.4
"""Factor by which the darkest colours are brightened, like the tone curve does with Filament's frames.

The colours of the town are brightened instead of its light, because more light would clip the white parts of a patch.
Patches are not brightened.
"""


def has_linear_colours(model: mujoco.MjModel) -> bool:
    """Whether the model declares its colours (`rgba`) as linear albedo; MuJoCo's default is sRGB.

    Args:
        model: the compiled world.
    """
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, "filament.material.base_color_type")
    if index < 0:
        return False
    begin, size = int(model.text_adr[index]), int(model.text_size[index])
    return bytes(model.text_data[begin : begin + size]).rstrip(b"\0") == b"linear"


def displayed_model(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy of a model whose colours are display values.

    OpenGL would decode a texture that is marked sRGB and show the linear result without encoding it, far too dark. In
    the copy such textures are not marked. If the model has linear colours, colours of geoms and materials are encoded
    and brightened, and colour textures are brightened. Lights of type `image`, which MuJoCo's OpenGL does not support,
    are off; the headlight gives ambient light only.

    Args:
        model: the compiled world; it is not changed.
    """
    shown = copy.copy(model)
    shown.tex_colorspace[:] = mujoco.mjtColorSpace.mjCOLORSPACE_LINEAR
    if has_linear_colours(model):
        pictures = model.mat_texid[:, mujoco.mjtTextureRole.mjTEXROLE_RGB]
        _lift_textures(shown, np.unique(pictures[pictures >= 0]))
        bare = pictures < 0
        shown.mat_rgba[~bare, :3] = encode_srgb(shown.mat_rgba[~bare, :3])
        shown.mat_rgba[bare, :3] = displayed_colour(shown.mat_rgba[bare, :3])
        own = has_own_colour(shown)
        shown.geom_rgba[own, :3] = displayed_colour(shown.geom_rgba[own, :3])
        strength = np.maximum(shown.light_diffuse.max(axis=1, keepdims=True), 1e-6)
        shown.light_diffuse[:] = strength * encode_srgb(shown.light_diffuse / strength)
    shown.light_active[shown.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE] = 0
    shown.vis.headlight.diffuse[:] = 0
    shown.vis.headlight.specular[:] = 0
    shown.vis.map.shadowclip = SHADOW_REACH_M / shown.stat.extent
    shown.vis.quality.shadowsize = min(int(shown.vis.quality.shadowsize), SHADOW_MAP_PX)
    return shown


def displayed_colour(albedo: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Converts linear albedo 0..1 to the display values 0..1 of a surface in full light, elementwise: sRGB-encoded
    and brightened.

    Args:
        albedo: values of any shape.
    """
    return _lifted(encode_srgb(albedo))


def _lift_textures(model: mujoco.MjModel, textures: npt.NDArray[np.integer]) -> None:
    table = np.floor(_lifted(np.arange(256) / 255) * 255 + 0.5).astype(np.uint8)
    for texture in textures:
        if model.tex_nchannel[texture] == 3:
            begin = int(model.tex_adr[texture])
            texels = model.tex_data[begin : begin + 3 * int(model.tex_width[texture]) * int(model.tex_height[texture])]
            texels[:] = table[texels]


def _lifted(value: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.asarray(value * LIFT / (1 + (LIFT - 1) * value))
