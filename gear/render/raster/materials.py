"""Materials of geoms in the form that the shaders read: albedo, surface parameters and textures."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.response import decode_srgb
from gear.contracts.rendering import has_own_colour
from gear.render.display_colours import has_linear_colours
from gear.values.geometry import Array

TEXTURE_ROLES = {"HAS_BASE": "RGB", "HAS_NORMAL": "NORMAL", "HAS_ORM": "ORM", "HAS_EMISSIVE": "EMISSIVE"}
"""MuJoCo's texture role for each preprocessor flag of the shaders, in the order of the shaders' samplers."""

DIELECTRIC = 0.04
"""Reflectance at normal incidence (f0) of all materials except metal."""

_DEFAULT_SHININESS = 0.5
_MOST_SHININESS = 128


@dataclass(frozen=True, slots=True, eq=False)
class GeomMaterials:
    """The materials of all geoms, one array row per geom.

    Attributes:
        albedo: (ngeom, 3) float32, linear RGB.
        surface: (ngeom, 4) float32: perceptual roughness, metallic, emission, reflectance at normal incidence.
        textures: (ngeom, 4) int32 texture ids in the order of `TEXTURE_ROLES`, -1 for none.
        is_invisible: (ngeom,) bool: whether the geom is fully transparent.
    """

    albedo: npt.NDArray[np.float32]
    surface: npt.NDArray[np.float32]
    textures: npt.NDArray[np.int32]
    is_invisible: npt.NDArray[np.bool_]


def materials_of(model: mujoco.MjModel) -> GeomMaterials:
    """The materials of all geoms in a model. Colours and patches that differ between samples (`Stage.paint_rgb`,
    `Stage.faces`) are not included.

    If a material has no roughness, the roughness is computed from Phong's shininess: (2 / (2 + 128 shininess)) ^ (1/4)
    is the perceptual roughness with an equally wide highlight. Partly transparent geoms are drawn as opaque.

    Args:
        model: the compiled world.
    """
    material = model.geom_matid
    bare = material < 0
    own = has_own_colour(model)
    rgba: Array = model.geom_rgba.astype(np.float64)
    rgba[~own] = model.mat_rgba[material[~own]]
    albedo = rgba[:, :3] if has_linear_colours(model) else decode_srgb(rgba[:, :3])
    surface = np.zeros((model.ngeom, 4), np.float32)
    surface[:] = (_roughness_of(_DEFAULT_SHININESS), 0.0, 0.0, DIELECTRIC)
    textures = np.full((model.ngeom, len(TEXTURE_ROLES)), -1, np.int32)
    if not bare.all():
        surface[~bare] = _surfaces(model)[material[~bare]]
        roles = [int(getattr(mujoco.mjtTextureRole, f"mjTEXROLE_{role}")) for role in TEXTURE_ROLES.values()]
        textures[~bare] = model.mat_texid[np.ix_(material[~bare], roles)]
    return GeomMaterials(
        albedo=albedo.astype(np.float32), surface=surface, textures=textures, is_invisible=np.asarray(rgba[:, 3] == 0)
    )


def _surfaces(model: mujoco.MjModel) -> npt.NDArray[np.float32]:
    """(nmat, 4) float32 surface parameters of each material, in the columns of `GeomMaterials.surface`."""
    rough, metallic = model.mat_roughness, model.mat_metallic
    return np.stack(
        [
            np.where(rough < 0, _roughness_of(model.mat_shininess), rough),
            np.maximum(metallic, 0.0),
            model.mat_emission,
            np.full(model.nmat, DIELECTRIC),
        ],
        axis=1,
    ).astype(np.float32)


def _roughness_of(shininess: npt.ArrayLike) -> Array:
    return np.asarray((2 / (2 + _MOST_SHININESS * np.asarray(shininess, np.float64))) ** 0.25)
