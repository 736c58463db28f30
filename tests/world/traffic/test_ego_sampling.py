"""The ego car is drawn where it sees the board, and behind the truck where the scene has one."""

from __future__ import annotations

import dataclasses

import pytest

from gear.testing.tiny_town import SMALL_RIG, tiny_world
from gear.values.errors import PlacementError
from gear.world.placement import PlacementSpace
from gear.world.scene_spec import EgoLimits
from gear.world.traffic.ego_sampling import EgoSampler
from gear.world.traffic.spawn import Spawner


def sampler(name: str, ego: EgoLimits | None = None) -> EgoSampler:
    world = tiny_world(name)
    bodies = {slot.body: world.types[slot.actor.name] for slot in world.slots}
    return EgoSampler(
        scene_name=name,
        scene=world.scene if ego is None else dataclasses.replace(world.scene, ego=ego),
        rig=SMALL_RIG,
        types=world.types,
        slots=world.slots,
        faces=world.faces,
        spawner=Spawner(world.lanes),
        space=PlacementSpace(world.placement_model, bodies, world.parked_m),
    )


@pytest.mark.parametrize("name", ["board", "truck"])
def test_every_face_is_in_view(name: str) -> None:
    ego_sampler = sampler(name)
    for sequence in range(3):
        road_users = ego_sampler.draw(0, sequence)
        assert ego_sampler.judge(road_users) == "seen"
        roles = [spawn.role for spawn in road_users.spawns.values()]
        assert roles == (["ego", "carrier"] if name == "truck" else ["ego"])
        assert road_users.protected == set(road_users.spawns)


def test_draws_repeat_and_differ_by_sequence() -> None:
    first, second = sampler("board"), sampler("board")
    places = [[(s.x_m, s.y_m) for s in one.draw(5, 0).spawns.values()] for one in (first, second)]
    assert places[0] == places[1]
    assert [(s.x_m, s.y_m) for s in first.draw(5, 1).spawns.values()] != places[0]


def test_limits_without_a_lane_are_refused() -> None:
    with pytest.raises(PlacementError, match=r"no lane lies within ego.ahead_m and ego.lateral_m"):
        sampler("board", EgoLimits(ahead_m=(500.0, 600.0), lateral_m=(-1.0, 1.0))).draw(0, 0)
