"""The readers of obstacles against a synthetic street, in which every distance is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gear.contracts.controllers import Obstacle
from gear.contracts.specs import TaskSpec
from gear.plugins.controllers import blind, depth, detect2d, semseg, stereo3d, truth
from gear.plugins.controllers.corridor import SIDE_MARGIN_M, Corridor
from gear.plugins.controllers.tracker import Sighting
from gear.plugins.manager import catalogue
from gear.testing.controller_contract import CAR, obstacles_of, straight_road
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR as CAR_PARTS
from gear.testing.things import PERSON, Thing

READERS = {"detect2d": detect2d, "stereo3d": stereo3d, "depth": depth, "semseg": semseg}
TOLERANCE_M = {"detect2d": 1.2, "stereo3d": 0.1, "depth": 0.8, "semseg": 1.5}
"""Largest error of a gap at 20 m in these pictures: the grid of the ground, of the pixels, of the percentile."""

WIDTH_PX = {"detect2d": 640, "stereo3d": 640, "depth": 640, "semseg": 1280}
"""Width of the pictures, twice their height. The semseg reader does not look far in small pictures."""


def car(ahead_m: float, left_m: float = 0.0, number: int = 2) -> Thing:
    return Thing(parts=CAR_PARTS, position_m=(ahead_m, left_m, 0.0), object_id=number, role="npc")


def person(ahead_m: float, left_m: float = 0.0) -> Thing:
    return Thing(parts=PERSON, position_m=(ahead_m, left_m, 0.0), object_id=3, role="pedestrian")


def sighting(name: str, things: list[Thing], width_px: int | None = None) -> Sighting | None:
    """What a reader sees when its network is perfect, in pictures of a width; None for that of `WIDTH_PX`."""
    spec = READERS[name].spec
    task = catalogue().get("task", name).spec
    assert isinstance(task, TaskSpec)
    width_px = WIDTH_PX[name] if width_px is None else width_px
    built: Any = task.build(task.config(width_px=width_px, height_px=width_px // 2))
    frame, record = synthetic_frame(built.rig(), things)
    observation = straight_road(built.as_prediction(built.ground_truth(frame, record)), rig=built.rig())
    controller: Any = spec.build(spec.config())
    return controller.nearest(observation, Corridor.of(observation))


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("ahead_m", [12.0, 22.0])
def test_the_gap_to_a_car_ahead_is_measured(name: str, ahead_m: float) -> None:
    found = sighting(name, [car(ahead_m)])
    assert found is not None
    assert found.gap_m == pytest.approx(ahead_m - 2.1 - CAR.front_m, abs=TOLERANCE_M[name])


@pytest.mark.parametrize("name", READERS)
def test_a_person_in_the_lane_is_seen(name: str) -> None:
    found = sighting(name, [person(15.0)])
    assert found is not None and found.gap_m == pytest.approx(15.0 - 0.25 - CAR.front_m, abs=1.5)


@pytest.mark.parametrize("name", READERS)
def test_cars_in_the_next_lanes_are_no_obstacles(name: str) -> None:
    assert sighting(name, [car(20.0, 3.5), car(20.0, -3.5, number=4)]) is None


@pytest.mark.parametrize("name", READERS)
def test_the_nearer_of_two_counts(name: str) -> None:
    found = sighting(name, [car(30.0), person(14.0)])
    assert found is not None and found.gap_m < 13.0


@pytest.mark.parametrize("name", ["detect2d", "stereo3d", "semseg"])
def test_a_crossing_person_is_seen_when_the_first_side_is_in_the_corridor(name: str) -> None:
    """The person is as wide as half a metre. The middle of the body is beside the corridor, one side is in it."""
    half_m = CAR.half_width_m + SIDE_MARGIN_M
    found = sighting(name, [person(15.0, -half_m - 0.1)])
    assert found is not None and found.gap_m == pytest.approx(15.0 - 0.25 - CAR.front_m, abs=1.5)
    assert sighting(name, [person(15.0, -half_m - 0.6)]) is None


def test_small_regions_of_people_are_no_obstacles() -> None:
    labels = np.full((512, 1024), 7, np.uint8)
    labels[300:310, 500:510] = 24
    labels[200:300, 100:150] = 25
    assert semseg.people_boxes(labels) == [(100.0, 200.0, 150.0, 300.0)]


def test_the_semseg_reader_does_not_search_where_a_row_of_pixels_is_long() -> None:
    """A row of pixels is 0.5 m long at 23 m with 640 px of focal length, and at 16 m with 320 px."""
    assert sighting("semseg", [car(22.0)]) is not None
    assert sighting("semseg", [car(22.0)], width_px=640) is None
    assert sighting("semseg", [car(15.0)], width_px=640) is not None


def test_no_point_of_the_corridor_is_outside_its_lateral_bounds() -> None:
    """The path bends to the left and back."""
    ahead_m = np.arange(0.0, 60.0)
    path_m = np.stack([ahead_m, 8.0 * np.sin(ahead_m / 12.0)], axis=1)
    corridor = Corridor(path_m=path_m, half_width_m=1.3, front_m=2.0)
    points_m = np.stack(np.meshgrid(np.arange(0.0, 60.0, 0.1), np.arange(-20.0, 20.0, 0.1)), axis=-1).reshape(-1, 2)
    arc_m, left_m = corridor.along(points_m)
    inside = (np.abs(left_m) < corridor.half_width_m) & (arc_m > 0) & (arc_m < corridor.length_m)
    from_m, to_m = corridor.lateral_bounds_m
    assert inside.sum() > 1000 and points_m[inside, 1].min() > from_m and points_m[inside, 1].max() < to_m


def test_the_blind_one_sees_nothing() -> None:
    observation = straight_road(obstacles=obstacles_of([car(10.0)]))
    assert blind.Blind(blind.BaselineConfig()).nearest(observation, Corridor.of(observation)) is None


def true_sighting(*obstacles: Obstacle, speed_mps: float = 10.0) -> Sighting | None:
    observation = straight_road(obstacles=obstacles, speed_mps=speed_mps)
    return truth.Truth(truth.BaselineConfig()).nearest(observation, Corridor.of(observation))


def walker(ahead_m: float, left_m: float, velocity_mps: tuple[float, float]) -> Obstacle:
    return Obstacle(
        id=5,
        kind="person",
        ahead_m=ahead_m,
        left_m=left_m,
        yaw_rad=0.0,
        half_length_m=0.3,
        half_width_m=0.3,
        velocity_mps=velocity_mps,
    )


def test_truth_measures_exactly() -> None:
    found = true_sighting(*obstacles_of([car(20.0)]))
    assert found == Sighting(gap_m=pytest.approx(20.0 - 2.1 - CAR.front_m), speed_mps=0.0)


def test_truth_stops_for_a_red_light_and_for_what_is_nearer() -> None:
    reader = truth.Truth(truth.BaselineConfig())
    light = replace(straight_road(), red_light_m=20.0)
    assert reader.nearest(light, Corridor.of(light)) == Sighting(gap_m=20.0, speed_mps=0.0)
    queue = replace(straight_road(obstacles=obstacles_of([car(15.0)])), red_light_m=20.0)
    nearer = reader.nearest(queue, Corridor.of(queue))
    assert nearer is not None and nearer.gap_m < 15.0


def test_truth_knows_that_a_vehicle_turns_into_the_next_lane() -> None:
    """At its speed of 7 m/s to the left it would be in the corridor in 0.9 s; but it turns towards the next lane."""

    def turning(yaw_rad: float) -> Obstacle:
        velocity = (7.0 * np.cos(yaw_rad), 7.0 * np.sin(yaw_rad))
        return Obstacle(
            id=4, kind="vehicle", ahead_m=12.0, left_m=-10.0, yaw_rad=yaw_rad, half_length_m=2.1, half_width_m=0.9,
            velocity_mps=velocity,
        )  # fmt: skip

    reader = truth.Truth(truth.BaselineConfig())
    found = []
    for time_s, yaw_rad in ((0.0, 1.5), (0.1, 1.42)):
        seen = straight_road(obstacles=(turning(yaw_rad),), time_s=time_s)
        found.append(reader.nearest(seen, Corridor.of(seen)))
    assert found[0] is not None and found[1] is None
    reader.reset(0)
    seen = straight_road(obstacles=(turning(1.42),), time_s=0.1)
    assert reader.nearest(seen, Corridor.of(seen)) is not None, "an earlier drive is forgotten"


def test_truth_sees_who_will_step_into_the_lane() -> None:
    assert true_sighting(walker(20.0, -4.0, (0.0, 1.4))) is not None
    assert true_sighting(walker(20.0, -4.0, (0.0, 0.0))) is None, "who stands on the sidewalk is no obstacle"
    assert true_sighting(walker(20.0, -4.0, (0.0, -1.4))) is None, "who walks away is none"
    assert true_sighting(walker(60.0, -4.0, (0.0, 1.4)), speed_mps=5.0) is None, "who is gone by then is none"


def test_truth_does_not_brake_for_oncoming_vehicles_on_their_lane() -> None:
    oncoming = Obstacle(
        id=4,
        kind="vehicle",
        ahead_m=25.0,
        left_m=3.5,
        yaw_rad=np.pi,
        half_length_m=2.1,
        half_width_m=0.9,
        velocity_mps=(-10.0, -0.8),
    )
    assert true_sighting(oncoming) is None
