"""Starts of drives: the bends that the ego car meets before the conflict."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from gear.driving.lane_path import LanePath
from gear.driving.start import BEYOND_M, MOST_LATERAL_MPS2, Draw, lateral_mps2
from gear.world.roads.polyline import Polyline
from gear.world.roads.routes import Route
from tests.driving.test_simulation import STANDARD, simulation


def path_of(points: np.ndarray) -> LanePath:
    line = Polyline.through(np.column_stack([points, np.zeros(len(points))]))
    route = Route(lanes=("lane",), starts_m=(0.0,), speeds_mps=(10.0,), line=line, is_dead_end=True)
    return LanePath(route=route, widths_m=(3.5,))


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("radius_m", [20.0, 60.0])
def test_the_lateral_acceleration_on_an_arc_is_that_of_the_circle(radius_m: float, side: int) -> None:
    angles = np.linspace(0.0, 1.5 * math.pi, 700)  # over the step of the heading from +180 to -180 degrees
    path = path_of(radius_m * np.column_stack([np.sin(angles), side * (1 - np.cos(angles))]))
    assert lateral_mps2(path, 5.0, 60.0, 10.0) == pytest.approx(100.0 / radius_m, rel=0.02)


def test_a_straight_road_needs_none_and_a_bend_beyond_the_stretch_does_not_count() -> None:
    straight = np.column_stack([np.linspace(0, 100, 11), np.zeros(11)])
    assert lateral_mps2(path_of(straight), 0.0, 80.0, 15.0) == 0.0
    corner = np.vstack([straight, [[100.0, 20.0]]])
    assert lateral_mps2(path_of(corner), 0.0, 80.0, 15.0) == 0.0
    assert lateral_mps2(path_of(corner), 0.0, 100.0, 15.0) > MOST_LATERAL_MPS2


@pytest.mark.parametrize("name", ["stopped_lead", "crossing_pedestrian"])
def test_a_conflict_is_ahead_and_not_around_a_corner(name: str) -> None:
    scenario = STANDARD[name]
    for seed in range(4):
        situation = simulation().reset(Draw(name=name, scenario=scenario, speed_mps=40 / 3.6, seed=seed))
        points = situation.path_m[: round(scenario.ttc_s * 40 / 3.6 + BEYOND_M) : 10]  # 1 m apart
        chords = np.diff(points, axis=0)
        turns = [
            abs(math.remainder(math.atan2(*after[::-1]) - math.atan2(*before[::-1]), math.tau))
            for before, after in pairwise(chords)
        ]
        assert max(turns) / 10.0 * (40 / 3.6) ** 2 <= 1.2 * MOST_LATERAL_MPS2
