"""The road as the ruler of a depth map: disparity of the road by row, and depth that the road has calibrated.

Networks that predict depth from one picture read the road too near or too far, by a factor that changes with the
distance and from frame to frame. Heights above a ground plane at a fixed place are then wrong: a road that is read at
two thirds of its distance seems to rise. What the picture itself says about the road is free of that error:

- The disparity (1 / depth) of the road by row of the picture is the road's profile in the V-disparity image (Labayrade,
  Aubert and Tarel, "Real time obstacle detection in stereovision on non flat road geometry through V-disparity
  representation", IEEE Intelligent Vehicles Symposium 2002). What stands on the road is nearer than the road in the
  same row.
- The known height of the camera gives the scale of the road (Xue et al., "Toward hierarchical self-supervised monocular
  absolute depth estimation for autonomous driving applications", IROS 2020), here row by row.
"""

from __future__ import annotations

import numpy as np

from gear.contracts.controllers import Points
from gear.plugins.controllers.corridor import pixel_rays
from gear.values.rig import CameraMount

FARTHEST_ROAD_M = 100.0
"""Distance of the flat road at the farthest row that the profile has, metres."""

ROAD_PERCENTILE = 30.0
"""Percentile of the disparities in a row that is the road's: objects beside and on the road are nearer than it."""

LARGEST_ERROR = 2.0
"""Largest factor by which the road may seem nearer than it is. A profile that is nearer is an obstacle that fills the
picture from side to side.
"""


def calibrated_depth_m(depth_m: Points, camera: CameraMount, stride_px: int = 1) -> Points:
    """Depth in which the road is where a flat ground under the car is.

    Each point gets the distance of the row in which the road has the point's disparity. A depth map whose error depends
    on the predicted depth alone, such as a wrong scale, gives the same result as the true one.

    Args:
        depth_m: (H, W) depth along the optical axis, metres; values that are not positive numbers count as infinite.
        camera: the camera with its pose on the car. It is level from side to side.
        stride_px: step in pixels, in both directions, at which `depth_m` was read from the picture.

    Returns:
        (H, W) depth along the optical axis, metres, at most `FARTHEST_ROAD_M`; infinite if no row shows the road.
    """
    is_known = np.isfinite(depth_m) & (depth_m > 0)
    disparity = np.divide(1.0, depth_m, out=np.zeros(depth_m.shape), where=is_known)
    rows = np.arange(depth_m.shape[0]) * stride_px
    flat = _flat_disparity(camera, rows.astype(np.float64))
    is_road = flat >= 1 / FARTHEST_ROAD_M
    if not is_road.any():
        return np.full(depth_m.shape, np.inf)
    flat = flat[is_road]
    profile = _road_of_rows(disparity[is_road])
    profile = np.maximum.accumulate(np.minimum(profile, LARGEST_ERROR * flat))
    found = np.where(disparity > 0, np.interp(disparity, profile, flat), 1 / FARTHEST_ROAD_M)
    nearest = profile[-1]
    if nearest > 0:  # nearer than the road at the lower edge of the picture
        found = np.where(disparity > nearest, disparity * flat[-1] / nearest, found)
    calibrated: Points = 1 / found
    return calibrated


def _road_of_rows(disparity: Points) -> Points:
    """The road's disparity in each row, (H,), from (H, W) disparities, 0 where unknown; 0 if nothing is known."""
    if (disparity > 0).all():
        profile: Points = np.percentile(disparity, ROAD_PERCENTILE, axis=1)
        return profile
    rows = [row[row > 0] for row in disparity]
    return np.array([np.percentile(known, ROAD_PERCENTILE) if len(known) else 0.0 for known in rows])


def _flat_disparity(camera: CameraMount, rows: Points) -> Points:
    """(N,) disparities, 1/m, of a flat ground under the car in the middle of (N,) rows; not positive above the
    horizon.
    """
    pixels = np.stack([np.full(len(rows), camera.intrinsics.cx_px), rows], axis=1)
    disparity: Points = -pixel_rays(camera, pixels)[:, 2] / camera.ego_from_camera.translation_m[2]
    return disparity
