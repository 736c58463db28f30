"""The road calibrates a depth map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.contracts.controllers import Points
from gear.contracts.specs import TaskSpec
from gear.plugins.controllers import depth
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.road_profile import FARTHEST_ROAD_M, calibrated_depth_m
from gear.plugins.manager import catalogue
from gear.testing.controller_contract import straight_road
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, Thing
from gear.values.rig import Rig


def street(*cars_m: float) -> tuple[Points, Rig]:
    """The true (320, 640) depth map of a flat street with cars at these distances, and the rig."""
    spec = catalogue().get("task", "depth").spec
    assert isinstance(spec, TaskSpec)
    task: Any = spec.build(spec.config(width_px=640, height_px=320))
    things = [
        Thing(parts=CAR, position_m=(ahead_m, 0.0, 0.0), object_id=2 + number, role="npc")
        for number, ahead_m in enumerate(cars_m)
    ]
    frame, record = synthetic_frame(task.rig(), things)
    return np.asarray(task.as_prediction(task.ground_truth(frame, record)), np.float64), task.rig()


def gap_m(depth_m: Points, rig: Rig) -> float | None:
    """The gap that the baseline on depth sees."""
    observation = straight_road(depth_m, rig=rig)
    found = depth.DepthDriver(depth.DepthDriverConfig()).nearest(observation, Corridor.of(observation))
    return None if found is None else found.gap_m


def bent(depth_m: Points) -> Points:
    """Depth as networks err: too near, and the more the farther a point is, up to half of the distance."""
    return depth_m * (0.5 + 0.45 / (1 + depth_m / 15))


def test_the_depth_of_a_true_road_does_not_change() -> None:
    depth_m, rig = street()
    near = (depth_m > 5) & (depth_m < 60)
    assert near.any()
    assert calibrated_depth_m(depth_m, rig.cameras[0])[near] == pytest.approx(depth_m[near], rel=0.01)


@pytest.mark.parametrize("scale", [0.6, 0.9, 1.4])
def test_a_wrong_scale_cancels(scale: float) -> None:
    depth_m, rig = street(20.0)
    assert gap_m(scale * depth_m, rig) == pytest.approx(gap_m(depth_m, rig), abs=0.01)


def test_a_road_that_is_read_too_near_is_no_obstacle_and_a_car_on_it_is_one() -> None:
    depth_m, rig = street()
    assert gap_m(bent(depth_m), rig) is None
    depth_m, rig = street(20.0)
    assert gap_m(bent(depth_m), rig) == pytest.approx(gap_m(depth_m, rig), abs=0.5)


def test_an_obstacle_that_fills_the_picture_is_seen() -> None:
    depth_m, rig = street()
    found = gap_m(np.minimum(depth_m, 6.0), rig)
    assert found is not None and found < 12.0


def test_values_that_are_no_distances_count_as_free() -> None:
    depth_m, rig = street()
    assert gap_m(np.full(depth_m.shape, np.nan), rig) is None
    for value in (np.nan, np.inf, 0.0, -1.0):
        depth_m[:, ::3] = value
        assert gap_m(depth_m, rig) is None, value
        assert (calibrated_depth_m(depth_m, rig.cameras[0]) <= FARTHEST_ROAD_M + 1e-9).all()


def test_a_picture_without_road_shows_nothing() -> None:
    depth_m, rig = street(20.0)
    assert np.isinf(calibrated_depth_m(depth_m[:100], rig.cameras[0])).all(), "these rows are above the horizon"
