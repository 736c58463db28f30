"""The baseline on depth: the 5th percentile of the distances of all points in the corridor that stand on the road.

The road itself calibrates the depth map (`road_profile`), so that a road that the network reads too near is no
obstacle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Observation
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.corridor import Corridor, pixel_rays
from gear.plugins.controllers.road_profile import calibrated_depth_m
from gear.plugins.controllers.tracker import Sighting
from gear.values.errors import FieldError

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
        rows, columns = np.mgrid[0 : camera.height_px : STRIDE_PX, 0 : camera.width_px : STRIDE_PX]
        rays = pixel_rays(camera, np.stack([columns.ravel(), rows.ravel()], axis=1).astype(np.float64))
        points_m = camera.ego_from_camera.translation_m + rays * depth_m.reshape(-1, 1)
        low_m, high_m = HEIGHTS_M
        is_object = np.isfinite(points_m).all(axis=1) & (points_m[:, 2] > low_m) & (points_m[:, 2] < high_m)
        reach_m = min(FARTHEST_M, corridor.length_m)
        is_object &= (points_m[:, 0] > 0) & (points_m[:, 0] < reach_m)
        arc_m, left_m = corridor.along(points_m[is_object][:, :2])
        inside = arc_m[(np.abs(left_m) < corridor.half_width_m) & (arc_m > corridor.front_m) & (arc_m < reach_m)]
        if len(inside) < LEAST_SHARE * depth_m.size:
            return None
        return Sighting(gap_m=max(0.0, float(np.percentile(inside, self._percentile)) - corridor.front_m))


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
