"""Drives of the built-in controllers with truth and without sight; no picture is rendered."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving.dynamics import DynamicsName
from gear.driving.lane_path import to_ego
from gear.driving.road_users import lateral_m
from gear.driving.scenario import load_scenarios
from gear.driving.simulation import FRAME_S, DriveSimulation, Situation
from gear.driving.start import Draw, LeadStart
from gear.driving.vehicle import VehicleState
from gear.plugins.controllers.baseline import Baseline, BaselineConfig
from gear.plugins.controllers.blind import Blind
from gear.plugins.controllers.truth import Truth
from gear.testing.tiny_town import SMALL_RIG, tiny_world
from gear.values.errors import PlacementError
from gear.values.serial import to_json

STANDARD = load_scenarios("standard").scenarios


@cache
def simulation(scene: str = "board", dynamics: DynamicsName = "kinematic") -> DriveSimulation:
    world = tiny_world(scene)
    return DriveSimulation(world, world.scene, dynamics)


def draw(name: str, speed_kmh: float, seed: int = 0) -> Draw:
    return Draw(name=name, scenario=STANDARD[name], speed_mps=speed_kmh / 3.6, seed=seed)


def drive(
    name: str,
    speed_kmh: float,
    controller: Baseline,
    seed: int = 0,
    scene: str = "board",
    dynamics: DynamicsName = "kinematic",
) -> list[Situation]:
    simulator = simulation(scene, dynamics)
    situations = [simulator.reset(draw(name, speed_kmh, seed))]
    controller.reset(seed)
    while not situations[-1].is_over:
        situations.append(simulator.step(controller.act(situations[-1].observation(with_truth=True))))
    return situations


def truth() -> Truth:
    return Truth(BaselineConfig())


def blind() -> Blind:
    return Blind(BaselineConfig())


@pytest.mark.parametrize("name", ["stopped_lead", "slower_lead", "crossing_pedestrian", "standing_pedestrian"])
@pytest.mark.parametrize(("speed_kmh", "dynamics"), [(30.0, "kinematic"), (60.0, "kinematic"), (60.0, "mujoco")])
def test_truth_is_saved_and_blindness_crashes(name: str, speed_kmh: float, dynamics: DynamicsName) -> None:
    saved = drive(name, speed_kmh, truth(), dynamics=dynamics)[-1]
    lost = drive(name, speed_kmh, blind(), dynamics=dynamics)[-1]
    assert saved.crash is None, saved.crash
    assert lost.crash is not None and lost.ending == "crash"
    assert lost.crash.kind == ("person" if "pedestrian" in name else "vehicle")
    assert lost.crash.time_s == pytest.approx(STANDARD[name].ttc_s, abs=0.15)
    closing_kmh = speed_kmh - (20.0 if name == "slower_lead" else 0.0)
    assert lost.crash.impact_mps * 3.6 == pytest.approx(closing_kmh, abs=1.0)


def test_behind_the_truck() -> None:
    assert drive("stopped_lead", 30.0, truth(), scene="truck")[-1].crash is None
    crash = drive("stopped_lead", 30.0, blind(), scene="truck")[-1].crash
    assert crash is not None and crash.actor_id == 2
    with pytest.raises(PlacementError, match="use a scene with boards"):
        simulation("truck").reset(draw("crossing_pedestrian", 30.0))


def test_a_free_road_is_driven_at_the_desired_speed_in_the_lane() -> None:
    situations = drive("free_road", 40.0, truth())
    assert situations[-1].ending == "time" and situations[-1].time_s == pytest.approx(8.0)
    assert all(abs(one.position.lateral_m) < 0.5 for one in situations)
    assert situations[-1].ego.speed_mps * 3.6 == pytest.approx(40.0, abs=2.0)


def test_a_drive_repeats_and_does_not_depend_on_earlier_drives() -> None:
    first = drive("crossing_pedestrian", 40.0, truth(), seed=3)
    drive("free_road", 30.0, blind(), seed=5)
    again = drive("crossing_pedestrian", 40.0, truth(), seed=3)
    assert [one.ego for one in first] == [one.ego for one in again]
    assert [one.obstacles for one in first] == [one.obstacles for one in again]
    other = drive("crossing_pedestrian", 40.0, truth(), seed=4)
    assert first[0].ego != other[0].ego


def test_the_start_does_not_depend_on_the_controller() -> None:
    one, other = simulation().reset(draw("stopped_lead", 40.0, 7)), simulation().reset(draw("stopped_lead", 40.0, 7))
    assert one.ego == other.ego and one.obstacles == other.obstacles


def test_a_wrong_turn_leaves_the_road() -> None:
    simulator = simulation()
    now = simulator.reset(draw("free_road", 40.0))
    while not now.is_over:
        now = simulator.step(Action(acceleration_mps2=0.0, steering_rad=-0.3))
    assert now.ending in ("off_road", "crash")
    assert simulator.step(Action(acceleration_mps2=0.0, steering_rad=0.0)) is now, "after the end nothing moves"


def test_traffic_reacts_to_the_ego_car() -> None:
    """A car that follows the ego car brakes when the ego car stands."""
    simulator = simulation()
    now = simulator.reset(draw("free_road", 30.0, 2))
    for _ in range(70):
        now = simulator.step(Action(acceleration_mps2=-4.0, steering_rad=0.0))
        assert now.crash is None


def test_the_record_shows_the_state() -> None:
    simulator = simulation()
    simulator.reset(draw("stopped_lead", 30.0))
    now = simulator.step(Action(acceleration_mps2=0.0, steering_rad=0.0))
    record = simulator.record(SMALL_RIG, 0)
    assert record.frame == 1 and record.time_s == pytest.approx(FRAME_S)
    assert record.ego.world_from_actor.position_m[:2] == pytest.approx((now.ego.x_m, now.ego.y_m), abs=1e-5)
    assert len(record.actors) == 1 + len(now.obstacles) == len({actor.id for actor in record.actors})
    assert record.camera("rgb").width_px == 320
    assert to_json(record) == to_json(simulator.record(SMALL_RIG, 0))
    assert simulator.record(replace(SMALL_RIG, follows_road=True), 0).cameras == record.cameras, "the road is level"
    lead = record.actor(2)
    ahead = to_ego(now.ego, np.array([lead.world_from_actor.position_m[:2]]))[0]
    assert ahead[0] == pytest.approx(now.obstacles[0].ahead_m, abs=1e-4)


def test_with_mujoco_the_camera_dives_and_the_drive_repeats() -> None:
    simulator, logs = simulation(dynamics="mujoco"), []
    for _ in range(2):
        now = simulator.reset(draw("stopped_lead", 50.0))
        level = simulator.record(SMALL_RIG, 0).cameras[0].world_from_camera.transform("world", "camera")
        assert level.rotation[2, 2] == pytest.approx(0.0, abs=1e-6), "before it brakes the camera looks straight ahead"
        for _ in range(10):
            now = simulator.step(Action(acceleration_mps2=-8.0, steering_rad=0.0))
        record = simulator.record(SMALL_RIG, 0)
        camera = record.cameras[0].world_from_camera.transform("world", "camera")
        assert camera.rotation[2, 2] < -0.015, "the camera looks down, because the nose dives"
        assert record.ego.world_from_actor.transform("world", "actor").rotation[2, 0] < -0.015
        logs.append((now.ego, now.world_from_ego.rotation.tobytes()))
        drive("free_road", 30.0, truth(), seed=5, dynamics="mujoco")
    assert logs[0] == logs[1]


def test_a_place_without_room_is_one_line() -> None:
    with pytest.raises(PlacementError, match="without a neighbouring lane") as caught:
        simulation().reset(draw("cut_in", 40.0))
    assert "\n" not in str(caught.value)


def test_a_cut_in_is_smooth() -> None:
    lead = LeadStart(body="car_0", s_m=0.0, speed_mps=5.0, lateral_m=3.5, cut_in=(1.0, 2.0))
    assert [lateral_m(lead, time_s) for time_s in (0.0, 1.0, 2.0, 3.0, 9.0)] == pytest.approx([3.5, 3.5, 1.75, 0, 0])


def test_the_ego_frame() -> None:
    state = VehicleState(x_m=10.0, y_m=5.0, yaw_rad=math.pi / 2, speed_mps=0.0)
    assert to_ego(state, np.array([[10.0, 8.0], [9.0, 5.0]])) == pytest.approx(np.array([[3.0, 0.0], [0.0, 1.0]]))
