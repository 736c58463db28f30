"""Measures of hand-written logs, for which every number is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.contracts.controllers import Action
from gear.driving.log import danger_of, frame_entry, log_bytes, log_hash
from gear.driving.measures import measure
from gear.driving.scenario import load_scenarios
from gear.driving.simulation import DriveSimulation
from gear.driving.start import Draw
from gear.testing.tiny_town import tiny_world
from gear.values.serial import to_json

STANDARD = load_scenarios("standard").scenarios


def log(
    name: str,
    frames: list[dict[str, Any]],
    *,
    crash: dict[str, Any] | None = None,
    conflict_s_m: float | None = 40.0,
    speed_mps: float = 10.0,
) -> list[Any]:
    draw = Draw(name=name, scenario=STANDARD[name], speed_mps=speed_mps, seed=0)
    usual = {
        "speed_mps": speed_mps, "acceleration_mps2": 0.0, "lateral_m": 0.0, "lane_width_m": 3.5, "gap_m": None,
        "ttc_s": None, "least_m": 5.0, "is_hazard": False, "command": [0.0, 0.0], "notes": {},
    }  # fmt: skip
    entries = [
        {**usual, "frame": number, "time_s": number / 10, "s_m": number * speed_mps / 10, **frame}
        for number, frame in enumerate(frames)
    ]
    head = {"scenario": to_json(draw), "start_s_m": 0.0, "conflict_s_m": conflict_s_m}
    return [head, *entries, {"ending": "crash" if crash else "time", "crash": crash}]


def test_a_crash_costs_its_factor() -> None:
    crash = {"kind": "person", "impact_mps": 4.0, "actor_id": 2, "time_s": 4.0}
    found = measure(log("standing_pedestrian", [{}] * 41, crash=crash))
    assert found.is_crash and found.crash_kind == "person" and found.impact_mps == 4.0
    assert found.progress == 1.0 and found.score == 0.5
    assert measure(log("standing_pedestrian", [{}] * 41)).score == 1.0


def test_the_way_to_a_standing_obstacle_ends_before_it() -> None:
    """At 10 m/s and a time to collision of 4 s, a perfect driver stops 5 m before the obstacle, after 35 m."""
    assert measure(log("stopped_lead", [{}] * 36)).progress == 1.0
    assert measure(log("stopped_lead", [{}] * 22)).progress == pytest.approx(0.6)


def test_phantom_brakings_are_counted_by_phase_and_only_without_a_hazard() -> None:
    hard, soft, right = {"command": [-5.0, 0.0]}, {}, {"command": [-5.0, 0.0], "is_hazard": True}
    frames = [soft, hard, hard, hard, soft, hard, soft, hard, hard, right, right, right]
    found = measure(log("free_road", frames, conflict_s_m=None))
    assert found.phantom_brakings == 2
    assert found.braking_s == pytest.approx(0.1)


def test_leaving_the_lane_costs_its_share_of_the_way() -> None:
    frames = [{}] * 41 + [{"lateral_m": 2.0}] * 40
    found = measure(log("free_road", frames, conflict_s_m=None))
    assert found.off_road_share == pytest.approx(0.5)
    assert found.lateral_peak_m == 2.0
    assert found.score == pytest.approx(found.progress * 0.5)


def test_jerk_is_the_change_of_acceleration() -> None:
    found = measure(log("free_road", [{}, {"acceleration_mps2": -1.0}, {"acceleration_mps2": -1.0}], conflict_s_m=None))
    assert found.jerk_peak_mps3 == pytest.approx(10.0)
    assert found.jerk_rms_mps3 == pytest.approx(np.sqrt(50.0))


def test_least_values_ignore_frames_without_an_obstacle() -> None:
    found = measure(log("stopped_lead", [{"gap_m": 9.0, "ttc_s": 2.0}, {}, {"gap_m": 4.0, "ttc_s": 3.0}]))
    assert (found.least_gap_m, found.least_ttc_s, found.least_distance_m) == (4.0, 2.0, 5.0)
    assert measure(log("free_road", [{}], conflict_s_m=None)).least_ttc_s is None


def test_a_log_is_canonical() -> None:
    one = log_bytes([{"b": 1.00000001, "a": [np.float64(-0.0), 2, True, None]}])
    assert one == b'{"a":[0.0,2,true,null],"b":1.0}\n'
    assert log_hash(one) == log_hash(log_bytes([{"a": [0.0, 2, True, None], "b": 1.0}]))


def test_danger_in_front_of_a_standing_car() -> None:
    world = tiny_world()
    simulation = DriveSimulation(world, world.scene)
    now = simulation.reset(Draw(name="stopped_lead", scenario=STANDARD["stopped_lead"], speed_mps=10.0, seed=0))
    danger = danger_of(now, simulation.scripted_id)
    assert danger.gap_m == pytest.approx(40.0, abs=0.2) and danger.ttc_s == pytest.approx(4.0, abs=0.02)
    assert danger.is_hazard
    entry = frame_entry(now, danger, Action(acceleration_mps2=1.0, steering_rad=0.0), simulation.ids)
    assert entry["command"] == [1.0, 0.0] and entry["actors"][0][0] == 2
    free = simulation.reset(Draw(name="free_road", scenario=STANDARD["free_road"], speed_mps=10.0, seed=0))
    assert simulation.scripted_id is None and danger_of(free, None).least_m is not None
