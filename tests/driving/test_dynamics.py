"""The kinematic bicycle behind the protocol of vehicle models."""

from __future__ import annotations

from gear.contracts.controllers import Action
from gear.driving.dynamics import PlanarCar
from gear.driving.vehicle import KinematicBicycle, VehicleState
from gear.testing.controller_contract import CAR
from gear.values.geometry import RigidTransform

POSE = RigidTransform.from_yaw("world", "actor", (1.0, 2.0, 0.0), 0.5)


def test_the_planar_car_is_the_bicycle_with_a_memory() -> None:
    state = VehicleState(x_m=1.0, y_m=2.0, yaw_rad=0.5, speed_mps=8.0)
    action, bicycle, car = Action(acceleration_mps2=-2.0, steering_rad=0.1), KinematicBicycle(car=CAR), PlanarCar(CAR)
    car.reset(state, POSE)
    for _ in range(5):
        state = bicycle.step(state, action, 0.1)
        assert car.step(action, 0.1) == state
    assert car.pose() is None and car.car is CAR


def test_a_reset_forgets_the_earlier_drive() -> None:
    state = VehicleState(x_m=1.0, y_m=2.0, yaw_rad=0.5, speed_mps=8.0)
    car, ends = PlanarCar(CAR), []
    for _ in range(2):
        car.reset(state, POSE)
        ends.append(car.step(Action(acceleration_mps2=-2.0, steering_rad=0.1), 0.5))
    assert ends[0] == ends[1]
