"""Checks of a town's materials. Each function returns the problems that it finds, one line each."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.response import decode_srgb
from gear.values.geometry import Array
from gear.world.assets.geom_classes import FIRST_HIDDEN_GROUP
from gear.world.compilation.materials import TEXTURE_KINDS, effective_rgba, textures_of, visible_materials

Mask = npt.NDArray[np.bool_]

COLOUR_ROLES = (
    mujoco.mjtTextureRole.mjTEXROLE_RGB,
    mujoco.mjtTextureRole.mjTEXROLE_RGBA,
    mujoco.mjtTextureRole.mjTEXROLE_EMISSIVE,
)

LARGEST_PX = 8192
"""Largest allowed side of a texture. All Vulkan drivers accept at least half of it, software drivers twice as much."""


def transparent(model: mujoco.MjModel) -> list[str]:
    """One line for each visible geom with an alpha below 1. Such geoms are not allowed, because ids and depth hold
    one geom for each pixel.

    Args:
        model: the compiled model.
    """
    alpha = effective_rgba(model)[:, 3]
    return [
        f"geom {model.geom(geom).name!r} has an alpha of {alpha[geom]:g}"
        for geom in np.flatnonzero((model.geom_group < FIRST_HIDDEN_GROUP) & (alpha < 1)).tolist()
    ]


def unphysical(model: mujoco.MjModel, most_albedo: float, faces: Mask | None = None) -> list[str]:
    """One line for each texture that renderers cannot show correctly, and for each geom that reflects too much light.

    Args:
        model: the compiled model of the town or of a scene.
        most_albedo: largest allowed albedo of a geom.
        faces: (ngeom,) bool mask of the patch surfaces; they are not checked, since gear makes their textures.
    """
    looked_at = (model.geom_group < FIRST_HIDDEN_GROUP) & ~(np.zeros(model.ngeom, bool) if faces is None else faces)
    problems = []
    for material, geom in visible_materials(model).items():
        if not looked_at[geom]:
            continue
        found = _odd_numbers(model, material)
        for role, texture in textures_of(model, material):
            found += _odd_texture(model, role, texture)
        problems += [f"material {model.mat(material).name!r} of geom {model.geom(geom).name!r} {one}" for one in found]
    return problems + _too_bright(model, most_albedo, looked_at)


def _odd_numbers(model: mujoco.MjModel, material: int) -> list[str]:
    found = []
    for name in ("emission", "metallic", "roughness"):
        value = float(getattr(model, f"mat_{name}")[material])
        # -1 means that the material does not set the number.
        if not 0 <= value <= 1 and (name == "emission" or value != -1):
            found.append(f"has {name} {value:g}, not 0 to 1")
    return found


def _odd_texture(model: mujoco.MjModel, role: int, texture: int) -> list[str]:
    name = f"texture {model.tex(texture).name!r}"
    kind = TEXTURE_KINDS[mujoco.mjtTexture(model.tex_type[texture])]
    if kind != "2D":
        return [f"has a {kind} texture, {name}, not a 2D one"]
    found = []
    is_srgb = model.tex_colorspace[texture] == mujoco.mjtColorSpace.mjCOLORSPACE_SRGB
    channels = int(model.tex_nchannel[texture])
    if role in COLOUR_ROLES:
        if not is_srgb:
            found.append(f'has colours in {name} that are not marked colorspace="sRGB"')
        if channels != 3:
            found.append(f"has colours in {name} of {channels} channels, not 3")
    elif is_srgb:
        found.append(f'has numbers in {name} that are marked colorspace="sRGB", as if they were colours')
    for side in (int(model.tex_width[texture]), int(model.tex_height[texture])):
        if side > LARGEST_PX or side & (side - 1):
            found.append(f"has {name} with a side of {side} px, not a power of two up to {LARGEST_PX}")
    return found


def _too_bright(model: mujoco.MjModel, most_albedo: float, looked_at: Mask) -> list[str]:
    problems = []
    rgba = effective_rgba(model)
    means: dict[int, Array] = {}
    for geom in np.flatnonzero(looked_at).tolist():
        albedo = rgba[geom, :3]
        material = int(model.geom_matid[geom])
        for role, texture in textures_of(model, material) if material >= 0 else []:
            if role in COLOUR_ROLES[:2]:
                if texture not in means:
                    means[texture] = _mean(model, texture)
                albedo = albedo * means[texture]
        if albedo.max() > most_albedo + 1e-6:
            problems.append(
                f"geom {model.geom(geom).name!r} has an albedo of {albedo.max():.2f}, above {most_albedo:g}"
            )
    return problems


def _mean(model: mujoco.MjModel, texture: int) -> Array:
    """The (3,) mean colour of a texture in linear light; textures of one or two channels are grey."""
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    count = int(model.tex_width[texture]) * int(model.tex_height[texture]) * channels
    pixels = model.tex_data[start : start + count].reshape(-1, channels)
    light = np.arange(256) / 255
    if model.tex_colorspace[texture] == mujoco.mjtColorSpace.mjCOLORSPACE_SRGB:
        light = decode_srgb(light)
    colours = pixels[:, :3] if channels >= 3 else pixels[:, [0, 0, 0]]
    return np.asarray(light[colours].mean(axis=0))
