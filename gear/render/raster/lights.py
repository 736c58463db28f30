"""A model's lights in units of the frame, where radiance 1 is full scale."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from gear.contracts.rendering import FULL_SCALE_LUX
from gear.render.culling import Mask
from gear.render.raster.environment import mirrored_levels
from gear.values.geometry import Array

MOST_LIGHTS = 4
LEAST_SUN = 1e-3
"""Irradiance whose shadows nobody sees: a tenth of a step of eight bits."""

_TYPE = mujoco.mjtLightType

DIRECTIONAL_SHARE = 0.2
"""How much of the difference between two opposite faces of the light's cube a surface shows that looks along them."""


@dataclass(frozen=True, slots=True, eq=False)
class Environment:
    """Light from all around.

    Attributes:
        irradiance: (4, 3) over pi: by itself, and by the normal's x, y and z.
        levels: (6, n, n, 3) float32 mirrored radiance, ever coarser; empty where there is none.
    """

    irradiance: Array
    levels: tuple[Array, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Lamps:
    """Light from one direction or place each.

    Attributes:
        towards: (N, 4) unit vectors towards it, or places in the world with a last number of 1.
        light: (N, 3) irradiance, or intensity of a place.
        casts: whether the first one throws shadows that can be seen.
    """

    towards: Array
    light: Array
    casts: bool


def environment_of(model: mujoco.MjModel, faces_of: dict[int, Array]) -> Environment:
    """From a light of the kind `image`; where there is none, all is dark that no lamp lights.

    Args:
        model: whose light.
        faces_of: (6, n, n, 3) linear faces of its cube textures, by id, in OpenGL's order.
    """
    for light in np.flatnonzero((model.light_type == _TYPE.mjLIGHT_IMAGE) & model.light_active).tolist():
        faces = faces_of.get(int(model.light_texid[light]))
        if faces is not None:
            radiance = faces * (float(model.light_intensity[light]) / FULL_SCALE_LUX)
            return Environment(irradiance_over_pi(radiance), mirrored_levels(radiance))
    return Environment(np.zeros((4, 3)), ())


def irradiance_over_pi(radiance: Array) -> Array:
    """What a white diffuse surface shows, as Filament works it out (measured): linear in its normal.

    Args:
        radiance: (6, n, n, 3).

    Returns:
        (4, 3) the mean of all faces, and what to add by the normal's x, y and z.
    """
    east, west, up, down, south, north = radiance.mean(axis=(1, 2))
    slopes = DIRECTIONAL_SHARE * np.stack([east - west, north - south, up - down])
    return np.concatenate([radiance.mean(axis=(0, 1, 2))[None], slopes])


def lamps_of(model: mujoco.MjModel, data: mujoco.MjData) -> Lamps:
    """The first `MOST_LIGHTS` lights that are not images; one that throws shadows comes first.

    Only light from one direction throws them, and what comes from a place shines all around. A light without an
    intensity is as bright as its diffuse colour on what faces it, for a lamp at a distance of one metre.
    """
    lit = np.flatnonzero((model.light_type != _TYPE.mjLIGHT_IMAGE) & model.light_active & _shines(model))
    is_far = model.light_type[lit] == _TYPE.mjLIGHT_DIRECTIONAL
    casts = is_far & model.light_castshadow[lit].astype(bool)
    lit, is_far, casts = (each[np.argsort(~casts, kind="stable")][:MOST_LIGHTS] for each in (lit, is_far, casts))
    towards = np.zeros((len(lit), 4))
    directions = data.light_xdir[lit] / np.linalg.norm(data.light_xdir[lit], axis=1, keepdims=True)
    towards[:, :3] = np.where(is_far[:, None], -directions, data.light_xpos[lit])
    towards[:, 3] = ~is_far
    strength = model.light_intensity[lit, None] / FULL_SCALE_LUX
    light = model.light_diffuse[lit] * np.where(strength > 0, strength, np.pi)
    return Lamps(
        towards=towards, light=np.asarray(light, np.float64), casts=bool(casts[:1].any() and light[0].max() > LEAST_SUN)
    )


def _shines(model: mujoco.MjModel) -> Mask:
    return np.asarray(model.light_diffuse.max(axis=1) > 0) if model.nlight else np.zeros(0, np.bool_)
