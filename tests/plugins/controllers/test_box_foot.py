"""The gap from the foot of a box, on a flat ground under a camera whose pose is known."""

from __future__ import annotations

import pytest

from gear.plugins.controllers.box_foot import NEAR_GAP_M, foot_gap_m
from gear.plugins.controllers.corridor import Corridor
from gear.testing.controller_contract import CAR, straight_road
from gear.values.rig import CameraMount

CAMERA = CameraMount(name="front", width_px=1200, height_px=600, focal_px=600.0)
FARTHEST_M = 60.0


def gap_of(ahead_m: float, left_m: float) -> float | None:
    """The gap to a box 0.5 m wide and 1.7 m high whose foot is at a point on the ground."""
    height_m, forward_m = CAMERA.position_m[2], ahead_m - CAMERA.position_m[0]
    left_px, right_px = (600.0 - 600.0 * (left_m + side) / forward_m for side in (0.25, -0.25))
    foot_px, head_px = (300.0 + 600.0 * (height_m - above_m) / forward_m for above_m in (0.0, 1.7))
    return foot_gap_m((left_px, head_px, right_px, foot_px), CAMERA, Corridor.of(straight_road()), FARTHEST_M)


@pytest.mark.parametrize("ahead_m", [8.0, 20.0, 50.0])
def test_the_foot_of_a_box_gives_its_distance(ahead_m: float) -> None:
    assert gap_of(ahead_m, 0.0) == pytest.approx(ahead_m - CAR.front_m, abs=1e-6)


def test_boxes_beside_the_corridor_or_too_far_away_are_no_obstacles() -> None:
    assert gap_of(20.0, 3.0) is None and gap_of(20.0, -3.0) is None and gap_of(FARTHEST_M + 1.0, 0.0) is None


def test_a_foot_above_the_horizon_is_nowhere_and_one_below_the_picture_is_near() -> None:
    corridor = Corridor.of(straight_road())
    assert foot_gap_m((590.0, 100.0, 610.0, 299.0), CAMERA, corridor, FARTHEST_M) is None
    near_m = foot_gap_m((500.0, 100.0, 700.0, 600.0), CAMERA, corridor, FARTHEST_M)
    assert near_m is not None and near_m <= NEAR_GAP_M
