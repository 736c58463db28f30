"""Reads the materials of a compiled model: colours of geoms, and a check for textures with which a renderer would
crash.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from gear.contracts.rendering import has_own_colour
from gear.values.errors import TownError
from gear.values.geometry import Array
from gear.world.assets.geom_classes import FIRST_HIDDEN_GROUP

TEXTURE_KINDS = {
    mujoco.mjtTexture.mjTEXTURE_2D: "2D",
    mujoco.mjtTexture.mjTEXTURE_CUBE: "cube",
    mujoco.mjtTexture.mjTEXTURE_SKYBOX: "skybox",
}
"""Names of the texture types in error messages."""

LARGEST_SIDE_PX = 16384
"""Largest side of a texture that Mesa's Vulkan and OpenGL drivers accept, pixels."""


def effective_rgba(model: mujoco.MjModel) -> Array:
    """The (ngeom, 4) float64 RGBA colours of geoms, 0..1: the geom's own colour if it has one, otherwise the
    colour of its material.

    Args:
        model: compiled model.
    """
    rgba: Array = model.geom_rgba.astype(np.float64)
    plain = ~has_own_colour(model)
    rgba[plain] = model.mat_rgba[model.geom_matid[plain]]
    return rgba


def visible_materials(model: mujoco.MjModel) -> dict[int, int]:
    """The materials that visible geoms use: the id of the first visible geom with the material, by material id.

    Args:
        model: compiled model.
    """
    first_geoms: dict[int, int] = {}
    for geom in np.flatnonzero((model.geom_group < FIRST_HIDDEN_GROUP) & (model.geom_matid >= 0)).tolist():
        first_geoms.setdefault(int(model.geom_matid[geom]), geom)
    return first_geoms


def textures_of(model: mujoco.MjModel, material: int) -> list[tuple[int, int]]:
    """The textures of a material as pairs (role, texture id); roles are values of `mujoco.mjtTextureRole`.

    Args:
        model: compiled model.
        material: id of the material.
    """
    return [(role, int(texture)) for role, texture in enumerate(model.mat_texid[material]) if texture >= 0]


def reject_fatal_textures(model: mujoco.MjModel, path: Path) -> None:
    """Checks that a model has no textures with which Filament would end the process without a message.

    Args:
        model: compiled model.
        path: the town's file, for error messages.

    Raises:
        TownError: a visible geom uses such a texture.
    """
    for material, geom in visible_materials(model).items():
        for _, texture in textures_of(model, material):
            problem = _fatal_texture(model, material, texture)
            if problem:
                wearing, wearer = _own(model.mat(material).name), _own(model.geom(geom).name)
                raise TownError(path, f"material {wearing!r} of geom {wearer!r} has {problem}")


def _fatal_texture(model: mujoco.MjModel, material: int, texture: int) -> str:
    """The reason why Filament cannot draw a material's texture, and what to do; "" if it can."""
    name = _own(model.tex(texture).name)
    width, height = int(model.tex_width[texture]), int(model.tex_height[texture])
    if width > LARGEST_SIDE_PX or height > LARGEST_SIDE_PX:
        return (
            f"a texture, {name!r}, of {width} x {height} pixels, and renderers take {LARGEST_SIDE_PX} a side at most; "
            "make it smaller"
        )
    is_physical = model.mat_metallic[material] >= 0 or model.mat_roughness[material] >= 0
    if is_physical and model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        return f"metallic or roughness and a cube texture, {name!r}, which Filament cannot draw; give it a 2D texture"
    if model.tex_nchannel[texture] == 1 and model.tex_colorspace[texture] == mujoco.mjtColorSpace.mjCOLORSPACE_SRGB:
        return (
            f'a texture of one channel, {name!r}, that is marked colorspace="sRGB", which Filament cannot draw; '
            "give it three channels"
        )
    return ""


def _own(name: str) -> str:
    """The name of an element in its own file, without the prefix that dm_control adds."""
    return name.rpartition("/")[2]
