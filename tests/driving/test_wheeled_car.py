"""The four-wheeled car against closed forms: stopping distances, turning radii, slopes, and rest."""

from __future__ import annotations

import math
from functools import cache

import mujoco
import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving.vehicle import LAG_S, VehicleState
from gear.driving.wheeled_car import GRAVITY_MPS2, TYRE_FRICTION, WHEELS, WheeledCar
from gear.testing.tiny_town import tiny_world
from gear.values.errors import GearError
from gear.values.geometry import RigidTransform

TICK_S = 0.025
COAST = Action(acceleration_mps2=0.0, steering_rad=0.0)
FULL_BRAKE = Action(acceleration_mps2=-8.0, steering_rad=0.0)
SLOPE = 0.1


@cache
def car(friction: float = TYRE_FRICTION, slope: float = 0.0) -> WheeledCar:
    """The ego car of the tiny town on an endless plane that climbs towards the east."""
    plane = mujoco.MjModel.from_xml_string(
        '<mujoco><compiler angle="radian"/><worldbody><geom type="plane" size="0 0 1" group="0"'
        f' euler="0 {-math.atan(slope)} 0"/></worldbody></mujoco>'
    )
    return WheeledCar(plane, tiny_world().types["car_saloon"], friction)


def begin(tested: WheeledCar, speed_mps: float, slope: float = 0.0, yaw_rad: float = 0.0) -> WheeledCar:
    pose = RigidTransform.from_yaw("world", "actor", (0.0, 0.0, 0.0), yaw_rad)
    if slope:
        c, s = math.cos(math.atan(slope)), math.sin(math.atan(slope))
        rotation = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
        pose = RigidTransform.from_parts("world", "actor", rotation, (0.0, 0.0, 0.0))
    tested.reset(VehicleState(x_m=0.0, y_m=0.0, yaw_rad=yaw_rad, speed_mps=speed_mps), pose)
    return tested


def drive(tested: WheeledCar, action: Action, duration_s: float) -> list[VehicleState]:
    return [tested.step(action, TICK_S) for _ in range(round(duration_s / TICK_S))]


def stopping_m(tested: WheeledCar, speed_mps: float) -> float:
    begin(tested, speed_mps)
    for _ in range(400):
        now = tested.step(FULL_BRAKE, TICK_S)
        if now.speed_mps == 0:
            assert abs(now.y_m) < 0.01 and abs(now.yaw_rad) < 0.01, "it brakes in a straight line"
            return now.x_m
    raise AssertionError("does not stop")


def radius_m(states: list[VehicleState]) -> float:
    """Radius of the circle that fits the positions best (Kåsa's method)."""
    points = np.array([(state.x_m, state.y_m) for state in states])
    rows = np.column_stack([2 * points, np.ones(len(points))])
    x_m, y_m, rest = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)[0]
    return math.sqrt(rest + x_m**2 + y_m**2)


@pytest.mark.parametrize("speed_kmh", [20.0, 40.0, 60.0])
def test_the_stopping_distance_is_that_of_the_brakes(speed_kmh: float) -> None:
    """v² / 2b, and the lag T adds v T - b T² / 2."""
    speed_mps = speed_kmh / 3.6
    expected_m = speed_mps**2 / 16 + speed_mps * LAG_S - 8 * LAG_S**2 / 2
    assert stopping_m(car(), speed_mps) == pytest.approx(expected_m, rel=0.02)


@pytest.mark.parametrize("speed_kmh", [20.0, 40.0, 60.0])
def test_on_a_slippery_road_the_stopping_distance_is_that_of_friction(speed_kmh: float) -> None:
    """v² / 2μg, after the time in which the lagged brake reaches μg: the speed lost in it and the way follow from the
    integral of b (1 - exp(-t / T)).
    """
    speed_mps, friction_mps2 = speed_kmh / 3.6, 0.5 * GRAVITY_MPS2
    reached_s = -LAG_S * math.log(1 - friction_mps2 / 8)
    lost_mps = 8 * reached_s - LAG_S * friction_mps2
    way_m = speed_mps * reached_s - 8 * (reached_s**2 / 2 - LAG_S * reached_s) - LAG_S**2 * friction_mps2
    expected_m = way_m + (speed_mps - lost_mps) ** 2 / (2 * friction_mps2)
    assert stopping_m(car(0.5), speed_mps) == pytest.approx(expected_m, rel=0.04)


@pytest.mark.parametrize("steering_rad", [0.1, -0.3])
def test_the_turning_radius_at_low_speed_is_that_of_the_bicycle(steering_rad: float) -> None:
    """The rear axle runs on a circle of radius L / tan(angle); the middle is half a wheelbase in front of it."""
    tested = begin(car(), 4.0)
    states = drive(tested, Action(acceleration_mps2=0.0, steering_rad=steering_rad), 12.0)[120:]
    wheelbase_m = tested.car.wheelbase_m
    assert radius_m(states) == pytest.approx(
        math.hypot(wheelbase_m / math.tan(steering_rad), wheelbase_m / 2), rel=0.01
    )
    assert math.copysign(1.0, states[-1].yaw_rate_radps) == math.copysign(1.0, steering_rad)
    assert states[-1].yaw_rate_radps == pytest.approx(
        4.0 / radius_m(states) * math.copysign(1.0, steering_rad), rel=0.02
    )


def test_the_faster_the_wider_and_never_beyond_the_friction() -> None:
    """Understeer: at the same steering angle the circle grows with the speed; the tyres carry at most μg."""
    radii_m, accelerations_mps2 = [], []
    for speed_mps in (4.0, 10.0, 14.0):
        states = drive(begin(car(), speed_mps), Action(acceleration_mps2=0.0, steering_rad=0.1), 10.0)[200:]
        radii_m.append(radius_m(states))
        accelerations_mps2.append(states[-1].yaw_rate_radps * states[-1].speed_mps)
    assert radii_m == sorted(radii_m) and radii_m[2] > radii_m[0] * 1.003
    states = drive(begin(car(), 18.0), Action(acceleration_mps2=0.0, steering_rad=0.2), 4.0)[80:]
    assert radius_m(states) > 1.5 * 2.7 / math.tan(0.2), "the front wheels slide, and the car pushes outwards"
    assert max(one.yaw_rate_radps * one.speed_mps for one in states) < 1.05 * TYRE_FRICTION * GRAVITY_MPS2
    assert max(accelerations_mps2) < TYRE_FRICTION * GRAVITY_MPS2


def test_it_holds_its_speed_on_the_flat_and_on_a_slope() -> None:
    for tested, slope in ((car(), 0.0), (car(slope=SLOPE), SLOPE)):
        last = drive(begin(tested, 16.0, slope), COAST, 8.0)[-1]
        assert last.speed_mps == pytest.approx(16.0, abs=0.05)
        assert abs(last.y_m) < 1e-3 and abs(last.yaw_rad) < 1e-6, "a symmetric car drives straight"


def test_it_accelerates_as_it_is_commanded() -> None:
    last = drive(begin(car(), 0.0), Action(acceleration_mps2=3.0, steering_rad=0.0), 5.0)[-1]
    assert last.speed_mps == pytest.approx(3.0 * (5.0 - LAG_S), rel=0.01)
    assert last.acceleration_mps2 == pytest.approx(3.0, abs=0.05)


def test_it_rests() -> None:
    tested = begin(car(), 0.0, yaw_rad=0.7)
    last = drive(tested, COAST, 5.0)[-1]
    assert math.hypot(last.x_m, last.y_m) < 1e-4 and last.speed_mps == 0.0
    assert last.yaw_rad == pytest.approx(0.7, abs=1e-5)
    assert abs(float(tested.pose().translation_m[2])) < 0.003, "the springs carry the body at its height"
    assert float(np.abs(tested.data.qvel).max()) < 1e-3


def test_a_braked_car_stays_on_a_slope() -> None:
    tested = begin(car(slope=SLOPE), 0.0, SLOPE)
    drive(tested, Action(acceleration_mps2=-1.0, steering_rad=0.0), 2.0)
    before_m = tested.pose().translation_m[0]
    drive(tested, Action(acceleration_mps2=-1.0, steering_rad=0.0), 10.0)
    assert abs(tested.pose().translation_m[0] - before_m) < 0.005


def test_the_body_dives_when_it_brakes_and_leans_out_of_a_turn() -> None:
    tested = begin(car(), 15.0)
    drive(tested, FULL_BRAKE, 0.8)
    assert -0.05 < tested.pose().rotation[2, 0] < -0.015, "the nose is lower than the tail"
    begin(tested, 12.0)
    drive(tested, Action(acceleration_mps2=0.0, steering_rad=0.08), 2.0)
    assert 0.005 < tested.pose().rotation[2, 1] < 0.06, "in a left turn the left side is higher"


def test_mass_and_inertia_are_those_of_a_car() -> None:
    tested = car()
    model, body = tested.model, tested.model.body("chassis")
    assert float(body.subtreemass[0]) == pytest.approx(tiny_world().types["car_saloon"].placement_body.mass_kg)
    roll, pitch, yaw = body.inertia
    assert 300 < roll < 800 and 1200 < pitch < 3000 and pitch < yaw < 3500
    loads_n = np.zeros(4)
    drive(begin(tested, 0.0), COAST, 3.0)
    for contact in range(tested.data.ncon):
        force = np.zeros(6)
        mujoco.mj_contactForce(model, tested.data, contact, force)
        tyre = model.geom(int(tested.data.contact[contact].geom[1])).name
        loads_n[WHEELS.index(tyre.removesuffix("_tyre"))] = force[0]
    assert loads_n.sum() == pytest.approx(1500 * GRAVITY_MPS2, rel=1e-3)
    assert 0.5 < loads_n[:2].sum() / loads_n.sum() < 0.6 and loads_n[0] == pytest.approx(loads_n[1], rel=1e-6)


def test_it_repeats_bit_for_bit() -> None:
    ends = []
    for _ in range(2):
        begin(car(), 12.0)
        drive(car(), Action(acceleration_mps2=1.0, steering_rad=0.05), 1.0)
        drive(car(), Action(acceleration_mps2=-8.0, steering_rad=-0.1), 1.0)
        ends.append((drive(car(), COAST, 0.5)[-1], car().pose().rotation.tobytes()))
        drive(begin(car(), 5.0), FULL_BRAKE, 0.3)
    assert ends[0] == ends[1]


def test_it_drives_over_kerbs_of_the_town() -> None:
    """From the road at y = -1.75 onto the kerb that is 0.15 m high."""
    tested = WheeledCar(tiny_world().placement_model, tiny_world().types["car_saloon"])
    pose = RigidTransform.from_yaw("world", "actor", (-60.0, -1.75, 0.0), -0.3)
    tested.reset(VehicleState(x_m=-60.0, y_m=-1.75, yaw_rad=-0.3, speed_mps=5.0), pose)
    drive(tested, COAST, 1.0)
    states = drive(tested, COAST, 1.5)
    assert states[-1].y_m < -4.0 and 0.1 < tested.pose().translation_m[2] < 0.3


def test_unstable_physics_are_one_line() -> None:
    tested = begin(car(0.7), 5.0)
    tested.data.qvel[0] = math.nan
    with pytest.raises(GearError, match="became unstable"):
        tested.step(COAST, TICK_S)
