"""The baseline on depth: the 5th percentile of the distances of all points in the corridor that stand on the road.

The road itself calibrates the depth map (`road_profile`), so that a road that the network reads too near is no
obstacle.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Observation, Points
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.corridor import Corridor, pixel_rays
from gear.plugins.controllers.road_profile import calibrated_depth_m
from gear.plugins.controllers.tracker import Sighting
from gear.values.errors import FieldError
from gear.values.rig import CameraMount

HEIGHTS_M = (0.4, 2.0)
"""Heights above the road of the points that count: above the road's own errors and below signs and bridges."""

FARTHEST_M = 50.0
"""Arc length on the path beyond which points do not count, metres: errors of depth and of the ground grow with it."""

LEAST_SHARE = 1e-3
"""Smallest share of the picture's pixels that an obstacle must have; a person at 15 m has 5e-3 of a depth picture."""

STRIDE_PX = 2
"""Step in pixels, in both directions, at which the depth map is read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthDriverConfig(BaselineConfig):
    """Options of the baseline on depth. They include the options of `BaselineConfig`.

    Attributes:
        percentile: percentile of the distances in the corridor that counts as the obstacle's distance, 0 to 50.
    """

    percentile: float = 5.0

    def __post_init__(self) -> None:
        BaselineConfig.__post_init__(self)
        if not 0 <= self.percentile <= 50:
            raise FieldError("percentile", f"must be 0 to 50, got {self.percentile:g}")


class DepthDriver(Baseline):
    """The baseline driver with a depth map.

    Args:
        config: options of the driver.
    """

    def __init__(self, config: DepthDriverConfig) -> None:
        super().__init__(config)
        self._percentile = config.percentile

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the nearest part (a percentile) of the points in the corridor that are higher than the road; None
        if there are too few.

        Args:
            observation: the frame; its prediction is the (H, W) depth map of the first camera, metres.
            corridor: the strip of road that the car needs, in the ego frame.
        """
        camera = observation.cameras[0]
        depth_m = np.asarray(observation.prediction, np.float64)[::STRIDE_PX, ::STRIDE_PX]
        depth_m = calibrated_depth_m(depth_m, camera, STRIDE_PX)
        x_m, y_m, z_m = _points_m(camera, depth_m.ravel())
        (low_m, high_m), (from_m, to_m) = HEIGHTS_M, corridor.lateral_bounds_m
        reach_m = min(FARTHEST_M, corridor.length_m)
        with np.errstate(invalid="ignore"):  # comparisons with NaN are false
            is_object = (z_m > low_m) & (z_m < high_m) & (x_m > 0) & (x_m < reach_m) & (y_m > from_m) & (y_m < to_m)
        arc_m, left_m = corridor.along(np.stack([x_m[is_object], y_m[is_object]], axis=1))
        inside = arc_m[(np.abs(left_m) < corridor.half_width_m) & (arc_m > corridor.front_m) & (arc_m < reach_m)]
        if len(inside) < LEAST_SHARE * depth_m.size:
            return None
        return Sighting(gap_m=max(0.0, float(np.percentile(inside, self._percentile)) - corridor.front_m))


def _points_m(camera: CameraMount, depth_m: Points) -> tuple[Points, Points, Points]:
    """Positions in the ego frame of the points that the pixels of a picture show: x, y and z, each (N,), metres.

    Args:
        camera: the camera with its pose on the car.
        depth_m: (N,) depth of each `STRIDE_PX`-th pixel along the optical axis, row by row; infinite where unknown.
    """
    rays, origin = _rays(camera), camera.ego_from_camera.translation_m
    with np.errstate(invalid="ignore"):
        return origin[0] + rays[0] * depth_m, origin[1] + rays[1] * depth_m, origin[2] + rays[2] * depth_m


@functools.lru_cache(maxsize=4)
def _rays(camera: CameraMount) -> Points:
    """(3, N) rays of each `STRIDE_PX`-th pixel of a camera, row by row, as `pixel_rays` returns them."""
    rows, columns = np.mgrid[0 : camera.height_px : STRIDE_PX, 0 : camera.width_px : STRIDE_PX]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64)
    rays = np.ascontiguousarray(pixel_rays(camera, pixels).T)
    rays.setflags(write=False)
    return rays


spec = ControllerSpec(
    name="depth_baseline",
    summary="Brakes for points of a depth map that stand on the road in the corridor.",
    config=DepthDriverConfig,
    build=DepthDriver,
    tasks=("depth",),
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[DepthDriverConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
