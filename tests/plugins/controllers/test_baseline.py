from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from gear.contracts.controllers import EgoState, Observation
from gear.plugins.controllers.baseline import BaselineConfig, following, steering
from gear.plugins.controllers.corridor import Corridor, ground_pixels, ground_points
from gear.plugins.controllers.tracker import Sighting, Tracker
from gear.plugins.controllers.truth import Truth
from gear.testing.controller_contract import CAR, obstacles_of, straight_road
from gear.testing.things import CAR as CAR_PARTS
from gear.testing.things import Thing
from gear.values.errors import FieldError
from gear.values.rig import CameraMount


def bend(radius_m: float) -> Observation:
    """A circle to the left, to which the car is tangential at its rear axle."""
    rear_m = CAR.wheelbase_m / 2
    angle = (np.arange(0.0, 60.0) + rear_m) / radius_m
    path_m = np.column_stack([radius_m * np.sin(angle) - rear_m, radius_m * (1 - np.cos(angle))])
    return replace(straight_road(), path_m=path_m)


def test_the_driver_model_has_its_known_equilibria() -> None:
    assert following(10.0, 10.0, math.inf, 0.0) == pytest.approx(0.0)
    assert following(0.0, 10.0, math.inf, 0.0) == pytest.approx(1.6)
    assert following(0.0, 10.0, 4.0, 0.0) == pytest.approx(0.0), "it stands at the standstill gap"
    assert following(10.0, 10.0, 20.0, 0.0) < -4, "it brakes hard for what stands near"


def test_steering_is_straight_on_a_straight_road_and_that_of_the_circle_on_a_bend() -> None:
    assert steering(straight_road()) == pytest.approx(0.0, abs=1e-9)
    assert steering(bend(50.0)) == pytest.approx(math.atan(CAR.wheelbase_m / 50.0), rel=0.03)


def test_below_the_limit_of_time_to_collision_the_car_brakes_fully_until_it_stops() -> None:
    driver = Truth(BaselineConfig())
    thing = Thing(parts=CAR_PARTS, position_m=(2.3 + 2.1 + 15.0, 0.0, 0.0), object_id=2, role="npc")
    hard = []
    for number, speed_mps in enumerate((10.0, 10.0, 6.0, 2.0, 0.0)):
        seen = straight_road(time_s=number * 0.1, speed_mps=speed_mps, obstacles=obstacles_of([thing]))
        hard.append(driver.act(seen).notes["is_emergency"])
    assert hard == [0.0, 1.0, 1.0, 1.0, 0.0], "2 of 3 frames confirm; a standing car is released"


def test_far_obstacles_are_a_matter_of_cruise_control() -> None:
    driver = Truth(BaselineConfig())
    thing = Thing(parts=CAR_PARTS, position_m=(45.0, 0.0, 0.0), object_id=2, role="npc")
    seen = [straight_road(time_s=number * 0.1, obstacles=obstacles_of([thing])) for number in range(3)]
    actions = [driver.act(one) for one in seen]
    assert all(action.notes["is_emergency"] == 0 for action in actions)
    assert -3.5 <= actions[-1].acceleration_mps2 < 0


@pytest.mark.parametrize(("speed_mps", "gap_m", "holds"), [(1.4, 5.5, True), (1.6, 5.5, False), (1.4, 6.5, False)])
def test_a_car_at_walking_pace_stops_and_holds(speed_mps: float, gap_m: float, holds: bool) -> None:
    driver = Truth(BaselineConfig())
    thing = Thing(parts=CAR_PARTS, position_m=(2.3 + 2.1 + gap_m, 0.0, 0.0), object_id=2, role="npc")
    for number in range(3):
        seen = straight_road(time_s=number * 0.1, speed_mps=speed_mps, obstacles=obstacles_of([thing]))
        action = driver.act(seen)
    assert (action.acceleration_mps2 == -3.5) == holds and action.notes["is_emergency"] == 0


def test_a_single_frame_confirms_nothing_and_memory_lasts_half_a_second() -> None:
    tracker = Tracker()
    assert tracker.update(Sighting(gap_m=20.0), 0.0, 0.0) is None
    assert tracker.update(None, 0.1, 0.0) is None
    assert tracker.update(Sighting(gap_m=20.0), 0.2, 0.0) is not None
    seen = [tracker.update(None, 0.2 + 0.1 * number, 0.0) is not None for number in range(1, 7)]
    assert seen == [True] * 4 + [False] * 2


def test_the_tracker_estimates_the_speed_of_the_leader() -> None:
    tracker, found = Tracker(), None
    for number in range(30):
        time_s = number * 0.1
        found = tracker.update(Sighting(gap_m=30.0 - 5.0 * time_s), time_s, 10.0)  # ego 10 m/s, leader 5 m/s
    assert found is not None
    assert found.speed_mps == pytest.approx(5.0, abs=0.3)


def test_a_sudden_nearer_obstacle_is_another_one() -> None:
    tracker = Tracker()
    for number in range(3):
        tracker.update(Sighting(gap_m=40.0), number * 0.1, 0.0)
    first = tracker.update(Sighting(gap_m=10.0), 0.3, 0.0)
    second = tracker.update(Sighting(gap_m=10.0), 0.4, 0.0)
    assert first is not None and first.gap_m == pytest.approx(40.0, abs=0.5)
    assert second is not None and second.gap_m == pytest.approx(10.0, abs=0.5)


def test_positions_along_a_bend_are_arc_lengths() -> None:
    corridor = Corridor.of(bend(30.0))
    rear_m = CAR.wheelbase_m / 2
    angle = (20.0 + rear_m) / 30.0
    point = np.array([[30.0 * np.sin(angle) - rear_m, 30.0 * (1 - np.cos(angle))]])
    arc_m, left_m = corridor.along(point)
    assert arc_m[0] == pytest.approx(20.0, abs=0.05) and left_m[0] == pytest.approx(0.0, abs=0.02)
    assert corridor.length_m == pytest.approx(59.0, abs=0.05)


def test_ground_points_and_pixels_are_inverse() -> None:
    camera = CameraMount(name="left", width_px=640, height_px=320, pitch_deg=3.0, yaw_deg=-4.0)
    points_m = np.array([[12.0, 1.0], [25.0, -3.0]])
    pixels, inside = ground_pixels(camera, points_m)
    assert inside.all()
    assert np.allclose(ground_points(camera, pixels), points_m)
    assert not ground_pixels(camera, np.array([[-5.0, 0.0]]))[1].any(), "the ground behind the car is not in view"
    assert np.isnan(ground_points(camera, np.array([[320.0, 0.0]]))).all(), "the sky is not on the ground"


def test_absurd_options_are_refused() -> None:
    with pytest.raises(FieldError, match="emergency_ttc_s"):
        BaselineConfig(emergency_ttc_s=-1)


def test_a_standing_car_stays_put_in_front_of_an_obstacle() -> None:
    thing = Thing(parts=CAR_PARTS, position_m=(2.3 + 2.1 + 2.0, 0.0, 0.0), object_id=2, role="npc")
    driver = Truth(BaselineConfig())
    standing = [replace(straight_road(time_s=n * 0.1, obstacles=obstacles_of([thing])), ego=EgoState(speed_mps=0.0))
                for n in range(3)]  # fmt: skip
    assert [driver.act(one).acceleration_mps2 < 0 for one in standing][-1]
