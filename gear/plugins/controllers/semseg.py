"""The baseline on semantic segmentation: the end of the drivable area in the corridor, and people whose foot is there.

The drivable area alone shows a crossing person late, because a person covers a small part of the corridor's width
until the middle of the body is in it. Each connected region of people therefore counts as an object with a box, as for
`detect2d`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.controllers import Observation, Points
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import ControllerSpec
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.box_foot import NEAR_GAP_M, foot_gap_m
from gear.plugins.controllers.corridor import Corridor, ground_pixels
from gear.plugins.controllers.tracker import Sighting
from gear.values.errors import FieldError
from gear.values.rig import CameraMount

DRIVABLE = (6, 7, 9, 10)
"""Cityscapes' label ids of ground on which cars drive: ground, road, parking and rail track."""

FARTHEST_M = 45.0
"""Arc length on the path up to which the ground is searched, metres, in any picture."""

MOST_ROW_M = 0.5
"""Largest length of ground in one row of pixels, metres; the ground is not searched beyond it, since borders of a label
map are wrong by some rows.
"""

STEP_M, ACROSS = 0.5, 9
"""Step along the path in metres, and number of points across the corridor."""

BLOCKED_M = 1.0
"""Length along the path, metres, over which the ground must be not drivable to be an obstacle."""

PEOPLE = (24, 25)
"""Cityscapes' label ids of people: person and rider."""

LEAST_PEOPLE = 2e-4
"""Smallest share of the picture's pixels that a region of people must have; a person at 15 m has 2e-3 of a picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SemsegDriverConfig(BaselineConfig):
    """Options of the baseline on semantic segmentation. They include the options of `BaselineConfig`.

    Attributes:
        least_drivable: share of the corridor's width that must be drivable, 0 to 1.
    """

    least_drivable: float = 0.85

    def __post_init__(self) -> None:
        BaselineConfig.__post_init__(self)
        if not 0 <= self.least_drivable <= 1:
            raise FieldError("least_drivable", f"must be 0 to 1, got {self.least_drivable:g}")


class SemsegDriver(Baseline):
    """The baseline driver with a map of labels.

    Args:
        config: options of the driver.
    """

    def __init__(self, config: SemsegDriverConfig) -> None:
        super().__init__(config)
        self._least_drivable = config.least_drivable

    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the end of the drivable area in the corridor or the nearest region of people there, whichever is
        nearer; None if none is in view.

        Args:
            observation: the frame; its prediction is the (H, W) map of label ids of the first camera.
            corridor: the strip of road that the car needs, in the ego frame.
        """
        labels, camera = np.asarray(observation.prediction), observation.cameras[0]
        reach_m = min(_reach_m(camera), corridor.length_m)
        gaps_m = [foot_gap_m(box_px, camera, corridor, reach_m) for box_px in people_boxes(labels)]
        gaps_m.append(self._drivable_m(labels, camera, corridor, reach_m))
        found = [gap_m for gap_m in gaps_m if gap_m is not None]
        return Sighting(gap_m=min(found)) if found else None

    def _drivable_m(
        self, labels: npt.NDArray[Any], camera: CameraMount, corridor: Corridor, reach_m: float
    ) -> float | None:
        """Free distance to the end of the drivable area in the corridor; None if the area does not end in view.

        Args:
            labels: (H, W) label ids.
            camera: the camera with its pose on the car.
            corridor: the strip of road that the car needs, in the ego frame.
            reach_m: arc length up to which the ground is searched.
        """
        arc_m = np.arange(corridor.front_m, reach_m, STEP_M)
        if not len(arc_m):
            return None
        points_m = _across(corridor, arc_m)
        pixels, is_seen = ground_pixels(camera, points_m.reshape(-1, 2))
        rows = np.clip(np.rint(pixels[:, 1]), 0, labels.shape[0] - 1).astype(np.intp)
        columns = np.clip(np.rint(pixels[:, 0]), 0, labels.shape[1] - 1).astype(np.intp)
        is_drivable = np.isin(labels[rows, columns], DRIVABLE).reshape(len(arc_m), ACROSS)
        is_seen = is_seen.reshape(len(arc_m), ACROSS)
        counts = is_seen.sum(axis=1)
        share = (is_drivable & is_seen).sum(axis=1) / np.maximum(counts, 1)
        known = np.flatnonzero(counts > ACROSS // 2)
        is_blocked = share[known] < self._least_drivable
        run = round(BLOCKED_M / STEP_M)
        for first in range(len(known) - run + 1):
            if is_blocked[first : first + run].all():
                gap_m = float(arc_m[known[first]]) - corridor.front_m
                return min(gap_m, NEAR_GAP_M) if first == 0 else gap_m
        return None


def people_boxes(labels: npt.NDArray[Any]) -> list[tuple[float, float, float, float]]:
    """Returns the boxes of the connected regions of people in a label map, in edge pixels: left, upper, right and lower
    side.

    Args:
        labels: (H, W) Cityscapes label ids.
    """
    is_person = np.isin(labels, PEOPLE).astype(np.uint8)
    _, _, regions, _ = cv2.connectedComponentsWithStats(is_person, connectivity=8)
    return [
        (float(left), float(top), float(left + width), float(top + height))
        for left, top, width, height, area in regions[1:]  # the first region is the background
        if area >= LEAST_PEOPLE * labels.size
    ]


def _reach_m(camera: CameraMount) -> float:
    """Arc length up to which the ground is searched. On a flat ground in the distance z, a row of pixels covers
    z² / (f h), with the focal length f in pixels and the height h of the camera.
    """
    position_m = camera.ego_from_camera.translation_m
    seen_m = math.sqrt(MOST_ROW_M * camera.intrinsics.fy_px * max(0.0, float(position_m[2])))
    return min(FARTHEST_M, float(position_m[0]) + seen_m)


def _across(corridor: Corridor, arc_m: Points) -> Points:
    """(N, ACROSS, 2) points across the corridor at (N,) arc lengths, in the ego frame."""
    lengths_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corridor.path_m, axis=0), axis=1))])
    middle = np.stack([np.interp(arc_m, lengths_m, corridor.path_m[:, axis]) for axis in (0, 1)], axis=1)
    directions = corridor.directions(arc_m)
    left = np.stack([-directions[:, 1], directions[:, 0]], axis=1)
    offsets_m = np.linspace(-corridor.half_width_m, corridor.half_width_m, ACROSS)
    points: Points = middle[:, None] + offsets_m[None, :, None] * left[:, None]
    return points


spec = ControllerSpec(
    name="semseg_baseline",
    summary="Brakes for the end of the drivable area in the corridor, and for people in it.",
    config=SemsegDriverConfig,
    build=SemsegDriver,
    tasks=("semseg",),
)


@hookimpl
def gear_controllers() -> list[ControllerSpec[SemsegDriverConfig]]:
    """Hook of the plugin system: returns the controller plugin that this module defines."""
    return [spec]
