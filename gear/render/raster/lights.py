"""The lights of a model, in units of the frame: a radiance of 1 is full scale."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from gear.contracts.rendering import FULL_SCALE_LUX
from gear.render.culling import Mask
from gear.render.raster.environment import mip_chain
from gear.values.geometry import Array

MAX_LIGHTS = 4
MIN_SUN = 1e-3
"""Irradiance below which shadows are not visible: a tenth of a step of 8-bit colour."""

_TYPE = mujoco.mjtLightType

DIRECTIONAL_SHARE = 0.2
"""Share of the radiance difference between two opposite faces of the environment map that appears in the
irradiance along their axis.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Environment:
    """The light that reaches surfaces from all directions (sky and houses).

    Attributes:
        irradiance: (4, 3) float64 irradiance divided by pi, as a linear function of the normal. The rows are the mean
            and the slopes along the normal's x, y, z; the columns are red, green, blue.
        levels: mip levels of the environment map, (6, n, n, 3) radiance each; empty for a model without one.
    """

    irradiance: Array
    levels: tuple[Array, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Lights:
    """The N lights of a model: distant lights, such as the sun, and point lights.

    Attributes:
        towards: (N, 4) float64. For a distant light: the unit vector towards it, and 0. For a point light: its world
            position, and 1.
        light: (N, 3) float64 RGB: irradiance of a distant light, intensity of a point light.
        casts_shadows: whether the first light casts visible shadows.
    """

    towards: Array
    light: Array
    casts_shadows: bool


def environment_of(model: mujoco.MjModel, faces_of: dict[int, Array]) -> Environment:
    """The environment light from the first active light of type `image`; black if the model has no such light.

    Args:
        model: the compiled world.
        faces_of: (6, n, n, 3) linear faces of the model's cube textures, by texture id, in OpenGL's order.
    """
    for light in np.flatnonzero((model.light_type == _TYPE.mjLIGHT_IMAGE) & model.light_active).tolist():
        faces = faces_of.get(int(model.light_texid[light]))
        if faces is not None:
            radiance = faces * (float(model.light_intensity[light]) / FULL_SCALE_LUX)
            return Environment(irradiance_over_pi(radiance), mip_chain(radiance))
    return Environment(np.zeros((4, 3)), ())


def irradiance_over_pi(radiance: Array) -> Array:
    """Irradiance divided by pi as a linear function of the normal, fitted to Filament's result.

    Args:
        radiance: (6, n, n, 3) faces of the environment map.

    Returns:
        (4, 3) array: the mean of all faces, and the slopes along the normal's x, y and z; columns are red, green, blue.
    """
    east, west, up, down, south, north = radiance.mean(axis=(1, 2))
    slopes = DIRECTIONAL_SHARE * np.stack([east - west, north - south, up - down])
    return np.concatenate([radiance.mean(axis=(0, 1, 2))[None], slopes])


def lights_of(model: mujoco.MjModel, data: mujoco.MjData) -> Lights:
    """The first `MAX_LIGHTS` active lights of a model, except lights of type `image`; a light that casts shadows comes
    first.

    Only distant lights cast shadows, and point lights shine in all directions. A light without an intensity gives its
    diffuse colour as irradiance to a surface that faces it; for a point light, this holds at a distance of one metre.

    Args:
        model: the compiled world.
        data: MuJoCo data of the model; positions and lights must be up to date.
    """
    lit = np.flatnonzero((model.light_type != _TYPE.mjLIGHT_IMAGE) & model.light_active & _shines(model))
    is_far = model.light_type[lit] == _TYPE.mjLIGHT_DIRECTIONAL
    casts_shadows = is_far & model.light_castshadow[lit].astype(bool)
    lit, is_far, casts_shadows = (
        each[np.argsort(~casts_shadows, kind="stable")][:MAX_LIGHTS] for each in (lit, is_far, casts_shadows)
    )
    towards = np.zeros((len(lit), 4))
    directions = data.light_xdir[lit] / np.linalg.norm(data.light_xdir[lit], axis=1, keepdims=True)
    towards[:, :3] = np.where(is_far[:, None], -directions, data.light_xpos[lit])
    towards[:, 3] = ~is_far
    strength = model.light_intensity[lit, None] / FULL_SCALE_LUX
    light = model.light_diffuse[lit] * np.where(strength > 0, strength, np.pi)
    has_shadows = bool(casts_shadows[:1].any() and light[0].max() > MIN_SUN)
    return Lights(towards=towards, light=np.asarray(light, np.float64), casts_shadows=has_shadows)


def _shines(model: mujoco.MjModel) -> Mask:
    return np.asarray(model.light_diffuse.max(axis=1) > 0) if model.nlight else np.zeros(0, np.bool_)
