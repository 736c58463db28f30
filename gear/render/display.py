"""A model's colours as OpenGL must be given them so that what it shows looks right."""

from __future__ import annotations

import copy

import mujoco
import numpy as np

from gear.camera.response import encode_srgb

SHADOW_REACH_M = 50.0
"""Half the side of the square on which classic's sun casts shadows; the renderer lays it before the camera."""

SHADOW_MAP_PX = 2048
"""Side of its shadow map: five centimetres a texel. Twice as many cost a tenth of a frame."""

_DEFAULT_RGBA = np.array([0.5, 0.5, 0.5, 1.0], np.float32)


def has_linear_colours(model: mujoco.MjModel) -> bool:
    """Whether the model says that its colours (`rgba`) are linear albedo; MuJoCo's habit is sRGB."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, "filament.material.base_color_type")
    if index < 0:
        return False
    begin, size = int(model.text_adr[index]), int(model.text_size[index])
    return bytes(model.text_data[begin : begin + size]).rstrip(b"\0") == b"linear"


def displayed_model(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy whose colours are display values.

    OpenGL would decode a texture that is marked sRGB, light it, and show the linear result as it is: far too dark. In
    the copy such textures are not marked, and linear colours of geoms and materials are encoded. Lights of the
    kind `image`, which OpenGL does not have, are off, and of the headlight only its ambient light remains.
    """
    shown = copy.copy(model)
    shown.tex_colorspace[:] = mujoco.mjtColorSpace.mjCOLORSPACE_LINEAR
    if has_linear_colours(model):
        shown.mat_rgba[:, :3] = encode_srgb(shown.mat_rgba[:, :3])
        # A geom with a material and this very colour shows the material's, so it must keep it.
        own = (shown.geom_matid < 0) | (shown.geom_rgba != _DEFAULT_RGBA).any(axis=1)
        shown.geom_rgba[own, :3] = encode_srgb(shown.geom_rgba[own, :3])
        strength = np.maximum(shown.light_diffuse.max(axis=1, keepdims=True), 1e-6)
        shown.light_diffuse[:] = strength * encode_srgb(shown.light_diffuse / strength)
    shown.light_active[shown.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE] = 0
    shown.vis.headlight.diffuse[:] = 0
    shown.vis.headlight.specular[:] = 0
    shown.vis.map.shadowclip = SHADOW_REACH_M / shown.stat.extent
    shown.vis.quality.shadowsize = min(int(shown.vis.quality.shadowsize), SHADOW_MAP_PX)
    return shown
