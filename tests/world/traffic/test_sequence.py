"""Frames of a sequence: vehicles move by their speed, and a single picture stands still."""

from __future__ import annotations

import numpy as np

from gear.config.collection import SplitConfig
from gear.testing.tiny_town import SMALL_RIG, tiny_world
from gear.world.planner import ScenePlanner
from gear.world.traffic.sequence import SLOWEST_MPS

INTERVAL_S = 0.1


def test_the_ego_car_moves_by_its_speed() -> None:
    split = SplitConfig(seed=0, samples=6, frames=6, interval_s=INTERVAL_S)
    planner = ScenePlanner(tiny_world("board"), SMALL_RIG, split, split_name="debug")
    records = [planner.plan(index) for index in range(6)]
    assert [record.frame for record in records] == list(range(6)) and {record.sequence for record in records} == {0}
    places = np.array([record.ego.world_from_actor.position_m for record in records])
    speeds = np.array([np.linalg.norm(record.ego.velocity_world_mps) for record in records])
    moved_m = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # Simulated in smaller steps than a frame, so the way lies between those of the speeds at its ends.
    low, high = np.minimum(speeds[:-1], speeds[1:]), np.maximum(speeds[:-1], speeds[1:])
    assert (moved_m >= (low - 0.1) * INTERVAL_S).all() and (moved_m <= (high + 0.1) * INTERVAL_S).all()
    assert speeds.max() >= SLOWEST_MPS
