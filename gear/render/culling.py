"""Finds the geoms that can be visible in a view.

OpenGL draws every geom of a scene, up to three times if there are shadows, so geoms outside the view are left out.
"""

from __future__ import annotations

import cv2
import mujoco
import numpy as np
import numpy.typing as npt

from gear.render.pinhole import NEAR_M, Frustum
from gear.values.geometry import Array

Mask = npt.NDArray[np.bool_]


def bounding_spheres(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """The bounding spheres of geoms: (ngeom, 3) centres in world coordinates and (ngeom,) radii, metres; the radii of
    planes are infinite.

    Args:
        model: compiled model.
        data: state of the model, with the world poses of its geoms.
    """
    return data.geom_xpos, bounding_radii(model)


def bounding_radii(model: mujoco.MjModel) -> Array:
    """The (ngeom,) radii of the bounding spheres of geoms, metres; infinite for geoms without bounds, such as
    planes.

    Args:
        model: compiled model.
    """
    return np.asarray(np.where(model.geom_rbound > 0, model.geom_rbound, np.inf))


def in_frustum(frustum: Frustum, centres_m: Array, radii_m: Array) -> Mask:
    """Tests which bounding spheres may be in a camera's view volume: (ngeom,) bool, False only for spheres that are
    certainly outside.

    Args:
        frustum: the camera's view volume.
        centres_m: (ngeom, 3) centres of the spheres, world coordinates.
        radii_m: (ngeom,) radii of the spheres.
    """
    right = np.cross(frustum.forward_world, frustum.up_world)
    towards = centres_m - frustum.position_world_m
    ahead = towards @ frustum.forward_world
    seen = ahead + radii_m > 0
    for axis, half_size_m, centre_m in (
        (right, frustum.half_width_m, frustum.centre_right_m),
        (frustum.up_world, frustum.half_height_m, frustum.centre_up_m),
    ):
        slope, middle = half_size_m / NEAR_M, centre_m / NEAR_M
        # Distance outside a side plane, along its normal. Both sides are tested at once, with the longer normal.
        beyond = (np.abs(towards @ axis - middle * ahead) - slope * ahead) / np.hypot(1.0, slope + abs(middle))
        seen &= beyond < radii_m
    return np.asarray(seen)


def in_beam(centre_m: Array, direction: Array, half_side_m: float, centres_m: Array, radii_m: Array) -> Mask:
    """Tests which bounding spheres may be in a square beam of light: (ngeom,) bool, False only for spheres that are
    certainly outside.

    The square may be rotated about the beam's axis, so the round beam around it is tested.

    Args:
        centre_m: (3,) a point on the beam's axis, world coordinates.
        direction: (3,) direction of the light, of any length.
        half_side_m: half the side of the square.
        centres_m: (ngeom, 3) centres of the spheres, world coordinates.
        radii_m: (ngeom,) radii of the spheres.
    """
    unit = direction / np.linalg.norm(direction)
    towards = centres_m - centre_m
    across = towards - (towards @ unit)[:, None] * unit
    return np.asarray(np.linalg.norm(across, axis=1) < radii_m + np.sqrt(2) * half_side_m)


def may_shadow(receivers_m: Array, axes: Array, margin_m: float, centres_m: Array, radii_m: Array) -> Mask:
    """Tests which bounding spheres may cast a shadow on a convex part of the world: (ngeom,) bool, False only if a
    sphere certainly casts none.

    Args:
        receivers_m: (N, 3) corners of that part.
        axes: (3, 3) rows: two unit vectors across the light's rays, and one towards the light.
        margin_m: distance by which the part is enlarged.
        centres_m: (ngeom, 3) centres of the spheres, world coordinates.
        radii_m: (ngeom,) radii of the spheres.
    """
    middle_m = receivers_m.mean(axis=0)
    corners, spheres = (receivers_m - middle_m) @ axes.T, (centres_m - middle_m) @ axes.T
    reach_m = radii_m + margin_m
    shadows = spheres[:, 2] + reach_m >= corners[:, 2].min()
    outline = cv2.convexHull(corners[:, :2].astype(np.float32)).reshape(-1, 2).astype(np.float64)
    for begin, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        along = end - begin
        outwards = np.array((along[1], -along[0])) / max(float(np.hypot(*along)), 1e-9)
        # The order of the outline's corners is OpenCV's choice; its middle is inside.
        outwards *= np.sign(outwards @ (begin - outline.mean(axis=0)))
        shadows &= (spheres[:, :2] - begin) @ outwards <= reach_m
    return np.asarray(shadows)


def near_to_far(chosen: Mask, depth_m: Array) -> npt.NDArray[np.intp]:
    """The indices of the chosen geoms, sorted by depth, smallest depth first; geoms with equal depths keep their order.

    Args:
        chosen: (ngeom,) bool.
        depth_m: (ngeom,) depth of each geom.
    """
    selection = np.flatnonzero(chosen)
    return np.asarray(selection[np.argsort(depth_m[selection], kind="stable")])
