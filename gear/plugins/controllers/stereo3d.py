"""The baseline on 3D boxes: the footprint of a box that reaches into the corridor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Observation, Points
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.formats.kitti_object import KittiLabel
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting
from gear.values.errors import FieldError
from gear.values.rig import CameraMount

SIGNS = ((1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1))
"""Corners and middles of the sides of a box's footprint, as signs of half the length and half the width."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Stereo3dDriverConfig(BaselineConfig):
    """Options of the baseline on 3D boxes. They include the options of `BaselineConfig`.

    Attributes:
        min_score: smallest confidence of a detection that counts, 0 to 1.
    """

    min_score: float = 0.5

    def __post_init__(self) -> None:
        BaselineConfig.__post_init__(self)
        if not 0 <= self.min_score <= 1:
            raise FieldError("min_score", f"must be 0 to 1, got {self.min_score:g}")


class Stereo3dDriver(Baseline):
    """The baseline driver with a detector of 3D boxes.

    Args:
        config: options of the driver.
    """

    def __init__(self, config: Stereo3dDriverConfig) -> None:
        super().__init__(config)
        self._min_score = config.min_score

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the 3D box that reaches into the corridor with the smallest gap; None without one.

        Args:
            observation: the frame; its prediction is KITTI labels in the frame of the first camera.
            corridor: the strip of road that the car needs, in the ego frame.
        """
        gaps_m = [
            corridor.gap_m(footprint(observation.cameras[0], label), corridor.length_m)
            for label in observation.prediction
            if label.type != "DontCare" and (label.score is None or label.score >= self._min_score)
        ]
        found = [gap_m for gap_m in gaps_m if gap_m is not None]
        return Sighting(gap_m=min(found)) if found else None


def footprint(camera: CameraMount, label: KittiLabel) -> Points:
    """(8, 2) points around the footprint of a KITTI label's 3D box, in the ego frame.

    Args:
        camera: the reference camera, in whose frame the box is.
        label: the label of one object.
    """
    c, s = math.cos(label.rotation_y_rad), math.sin(label.rotation_y_rad)
    forward, side = np.array([c, 0.0, -s]), np.array([s, 0.0, c])
    half = [(a * label.length_m / 2, b * label.width_m / 2) for a, b in SIGNS]
    corners = np.array([np.array(label.location_m) + along * forward + aside * side for along, aside in half])
    pose = camera.ego_from_camera
    points: Points = (corners @ pose.rotation.T + pose.translation_m)[:, :2]
    return points


spec = ControllerSpec(
    name="stereo3d_baseline",
    summary="Brakes for 3D boxes that reach into the corridor.",
    config=Stereo3dDriverConfig,
    build=Stereo3dDriver,
    tasks=("stereo3d",),
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[Stereo3dDriverConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
