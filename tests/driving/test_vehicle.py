"""The vehicle against closed forms: stopping distance, turning radius, lag, friction circle."""

from __future__ import annotations

import math

import pytest

from gear.contracts.controllers import Action
from gear.driving.vehicle import KinematicBicycle, VehicleState
from gear.testing.controller_contract import CAR

IDEAL = KinematicBicycle(car=CAR, lag_s=0.0)
REAL = KinematicBicycle(car=CAR)


def state(speed_mps: float) -> VehicleState:
    return VehicleState(x_m=0.0, y_m=0.0, yaw_rad=0.0, speed_mps=speed_mps)


def braked(car: KinematicBicycle, speed_mps: float, braking_mps2: float = 8.0) -> VehicleState:
    now = state(speed_mps)
    for _ in range(100):
        now = car.step(now, Action(acceleration_mps2=-braking_mps2, steering_rad=0.0), 0.1)
    return now


@pytest.mark.parametrize("speed_kmh", [20.0, 40.0, 60.0, 90.0])
def test_the_stopping_distance_is_that_of_constant_braking(speed_kmh: float) -> None:
    speed_mps = speed_kmh / 3.6
    assert braked(IDEAL, speed_mps).x_m == pytest.approx(speed_mps**2 / 16, rel=1e-3)


@pytest.mark.parametrize("speed_kmh", [40.0, 60.0, 90.0])
def test_the_lag_lengthens_the_stopping_distance_by_speed_times_lag(speed_kmh: float) -> None:
    """With a first-order lag T: v T is added, and b T² / 2 subtracted, once the lag has died out."""
    speed_mps = speed_kmh / 3.6
    expected_m = speed_mps**2 / 16 + speed_mps * 0.2 - 8 * 0.2**2 / 2
    assert braked(REAL, speed_mps).x_m == pytest.approx(expected_m, rel=5e-3)


def test_brakes_are_limited_and_a_stopped_car_stays() -> None:
    assert braked(IDEAL, 10.0, 100.0).x_m == pytest.approx(braked(IDEAL, 10.0).x_m)
    assert braked(REAL, 10.0).speed_mps == 0.0
    assert braked(REAL, 0.0).x_m == 0.0


def test_the_turning_radius_is_that_of_the_bicycle() -> None:
    """The rear axle runs on a circle of radius L / tan(angle); the middle is half a wheelbase ahead of it."""
    steering_rad = 0.3
    now, points = state(5.0), []
    for _ in range(1000):
        now = IDEAL.step(now, Action(acceleration_mps2=0.0, steering_rad=steering_rad), 0.02)
        points.append((now.x_m, now.y_m))
    expected_m = math.hypot(CAR.wheelbase_m / math.tan(steering_rad), CAR.wheelbase_m / 2)
    assert (max(y for _, y in points) - min(y for _, y in points)) / 2 == pytest.approx(expected_m, rel=5e-3)
    assert now.speed_mps == pytest.approx(5.0)


def test_left_is_positive() -> None:
    assert IDEAL.step(state(5.0), Action(acceleration_mps2=0.0, steering_rad=0.2), 1.0).y_m > 0


@pytest.mark.parametrize("braking_mps2", [0.0, 4.0, 8.0])
def test_tyres_carry_a_limited_force_in_all_directions_together(braking_mps2: float) -> None:
    now = state(25.0)
    for _ in range(20):
        now = REAL.step(now, Action(acceleration_mps2=-braking_mps2, steering_rad=0.5), 0.05)
        side_mps2 = now.yaw_rate_radps * now.speed_mps
        assert math.hypot(side_mps2, now.acceleration_mps2) <= REAL.friction_mps2 * 1.01
    assert side_mps2 > 0


def test_a_long_step_equals_many_short_ones() -> None:
    action = Action(acceleration_mps2=-3.0, steering_rad=0.1)
    whole, parts = REAL.step(state(15.0), action, 0.1), state(15.0)
    for _ in range(4):
        parts = REAL.step(parts, action, 0.025)
    assert whole.x_m == pytest.approx(parts.x_m) and whole.yaw_rad == pytest.approx(parts.yaw_rad)
