from __future__ import annotations

import math

import pytest

from gear.driving.crash import CrashDetector, impact_mps
from gear.testing.tiny_town import tiny_world
from gear.values.geometry import RigidTransform
from gear.world.assets.scene_assets import EGO_ASSET
from gear.world.placement import PlacementSpace
from gear.world.traffic.spawn import Spawn


@pytest.fixture(scope="module")
def detector() -> CrashDetector:
    world = tiny_world()
    bodies = {slot.body: world.types[slot.actor.name] for slot in world.slots}
    space = PlacementSpace(world.placement_model, bodies, world.parked_m)
    return CrashDetector(space, world.slots[0].body, world.types[EGO_ASSET])


def other(x_m: float, yaw_rad: float = 0.0, speed_mps: float = 0.0) -> Spawn:
    world = tiny_world()
    slot = next(slot for slot in world.slots[1:] if slot.actor.kind == "car")
    actor_type = world.types[slot.actor.name]
    return Spawn(
        role="npc",
        actor_type=actor_type,
        body=slot.body,
        x_m=x_m,
        y_m=-1.75,
        near_z_m=0.0,
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
    )


def at(x_m: float, y_m: float = -1.75) -> RigidTransform:
    return RigidTransform.from_yaw("world", "actor", (x_m, y_m, 0.0), 0.0)


def test_contact_begins_where_the_bodies_meet(detector: CrashDetector) -> None:
    spawn = other(0.0)
    world = tiny_world()
    reach_m = world.types[EGO_ASSET].front_m + spawn.actor_type.rear_m
    assert detector.hit(at(-reach_m - 0.3), {spawn.body: spawn}) is None
    assert detector.hit(at(-reach_m + 0.3), {spawn.body: spawn}) == spawn.body


def test_the_town_is_hit_beside_the_road(detector: CrashDetector) -> None:
    assert not detector.hits_town(at(-40.0))
    assert any(detector.hits_town(at(x_m, y_m)) for x_m in range(-60, 60, 4) for y_m in (-14.0, 14.0, -20.0, 20.0))


def test_the_impact_is_the_relative_speed() -> None:
    assert impact_mps(10.0, 0.0, None) == 10.0
    assert impact_mps(10.0, 0.0, other(5.0, speed_mps=4.0)) == pytest.approx(6.0)
    assert impact_mps(10.0, 0.0, other(5.0, yaw_rad=math.pi, speed_mps=4.0)) == pytest.approx(14.0)
