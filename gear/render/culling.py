"""Which geoms a view needs. OpenGL is handed whatever the scene holds, three times over where there are shadows."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.render.pinhole import NEAR_M, Frustum
from gear.values.geometry import Array

Mask = npt.NDArray[np.bool_]


def bounding_spheres(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """Centres (ngeom, 3) and radii (ngeom,) in metres, world frame; what has no bounds is everywhere."""
    return data.geom_xpos, bounding_radii(model)


def bounding_radii(model: mujoco.MjModel) -> Array:
    """(ngeom,) in metres; what has no bounds is endless."""
    return np.asarray(np.where(model.geom_rbound > 0, model.geom_rbound, np.inf))


def in_frustum(frustum: Frustum, centres_m: Array, radii_m: Array) -> Mask:
    """(ngeom,) whether a sphere reaches into the view; never False for one that does."""
    right = np.cross(frustum.forward_world, frustum.up_world)
    towards = centres_m - frustum.position_world_m
    ahead = towards @ frustum.forward_world
    seen = ahead + radii_m > 0
    for axis, half_size_m, centre_m in (
        (right, frustum.half_width_m, frustum.centre_right_m),
        (frustum.up_world, frustum.half_height_m, frustum.centre_up_m),
    ):
        slope, middle = half_size_m / NEAR_M, centre_m / NEAR_M
        # Distance beyond the side's plane, measured along its normal; both sides at once, with the longer normal.
        beyond = (np.abs(towards @ axis - middle * ahead) - slope * ahead) / np.hypot(1.0, slope + abs(middle))
        seen &= beyond < radii_m
    return np.asarray(seen)


def in_beam(centre_m: Array, direction: Array, half_side_m: float, centres_m: Array, radii_m: Array) -> Mask:
    """(ngeom,) whether a sphere reaches into the beam of light about a line, `half_side_m` wide to each side.

    The square may be turned about the line, so the beam is taken as round and as wide as the square's diagonal.
    """
    unit = direction / np.linalg.norm(direction)
    towards = centres_m - centre_m
    across = towards - (towards @ unit)[:, None] * unit
    return np.asarray(np.linalg.norm(across, axis=1) < radii_m + np.sqrt(2) * half_side_m)


def near_to_far(chosen: Mask, depth_m: Array) -> npt.NDArray[np.intp]:
    """Indices of what is chosen by growing depth, equal ones in their own order."""
    selection = np.flatnonzero(chosen)
    return np.asarray(selection[np.argsort(depth_m[selection], kind="stable")])
