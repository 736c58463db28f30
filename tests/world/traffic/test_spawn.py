"""Road users are drawn from free slots, by the weights of assets and colours, and where they fit."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest

from gear.testing.tiny_town import tiny_world
from gear.world.assets.actor_types import ActorType
from gear.world.traffic.spawn import FreeSlots, Spawner, draw_paint


@pytest.fixture(scope="module")
def types() -> dict[str, ActorType]:
    return dict(tiny_world("truck").types)


def weighted(actor_type: ActorType, weight: float) -> ActorType:
    return dataclasses.replace(actor_type, facts=dataclasses.replace(actor_type.facts, weight=weight))


def test_a_slot_is_taken_and_released() -> None:
    free = FreeSlots.of(tiny_world("truck").slots)
    assert "carrier" not in [body for bodies in free.bodies.values() for body in bodies]
    bodies = list(free.bodies["van_small"])
    taken = [free.take("van_small") for _ in bodies]
    assert taken == bodies and not free.bodies["van_small"]
    free.release("van_small", taken[0])
    assert free.take("van_small") == taken[0]


def test_assets_are_drawn_by_their_weights(types: dict[str, ActorType]) -> None:
    vehicles = {name: weighted(kind, 0.0) for name, kind in types.items() if not kind.is_person}
    names = sorted(vehicles)
    vehicles[names[0]], vehicles[names[1]] = weighted(types[names[0]], 1.0), weighted(types[names[1]], 3.0)
    people = {name: kind for name, kind in types.items() if kind.is_person}
    free = FreeSlots({name: ["body"] for name in types})
    rng = np.random.default_rng(0)
    drawn: Counter[str] = Counter()
    for _ in range(4000):
        actor_type = free.draw({**vehicles, **people}, rng, people=False)
        assert actor_type is not None
        drawn[actor_type.facts.name] += 1
    assert set(drawn) == {names[0], names[1]}
    assert drawn[names[1]] / drawn.total() == pytest.approx(0.75, abs=0.03)
    person = free.draw({**vehicles, **people}, rng, people=True)
    assert person is not None and person.is_person
    assert FreeSlots({}).draw(types, rng, people=True) is None


def test_each_draw_is_among_the_given_types(types: dict[str, ActorType]) -> None:
    free = FreeSlots({name: ["body"] for name in types})
    rng = np.random.default_rng(0)
    for name in ("van_small", "car_saloon", "van_small"):
        drawn = free.draw({name: types[name]}, rng, people=False)
        assert drawn is not None and drawn.facts.name == name
    assert free.draw({}, rng, people=False) is None


def test_colours_are_drawn_by_their_weights(types: dict[str, ActorType]) -> None:
    car = types["car_saloon"]
    palette = (((1.0, 0.0, 0.0), 1.0), ((0.0, 1.0, 0.0), 0.0), ((0.0, 0.0, 1.0), 3.0))
    painted = dataclasses.replace(car, facts=dataclasses.replace(car.facts, palette=palette))
    rng = np.random.default_rng(0)
    drawn = Counter(draw_paint(painted, rng) for _ in range(4000))
    assert drawn[(0.0, 1.0, 0.0)] == 0 and drawn[(0.0, 0.0, 1.0)] / 4000 == pytest.approx(0.75, abs=0.03)
    assert draw_paint(dataclasses.replace(car, facts=dataclasses.replace(car.facts, palette=())), rng) is None


def test_what_does_not_fit_is_not_parked(types: dict[str, ActorType]) -> None:
    world = tiny_world("truck")
    spawner, bay, rng = Spawner(world.lanes), world.lanes.bays[0], np.random.default_rng(0)
    car = types["car_saloon"]
    parked = spawner.in_bay(car, "car_saloon_0", bay, rng)
    assert parked is not None and parked.role == "parked" and parked.speed_mps == 0
    assert np.hypot(parked.x_m - bay.position_m[0], parked.y_m - bay.position_m[1]) < 0.5
    assert spawner.in_bay(dataclasses.replace(car, half_length_m=bay.length_m), "car_saloon_0", bay, rng) is None


def test_two_wheelers_keep_to_the_right(types: dict[str, ActorType]) -> None:
    world = tiny_world("truck")
    spawner, rng = Spawner(world.lanes), np.random.default_rng(0)
    bicycle, car = types["bicycle_rider"], types["car_saloon"]
    sides = [spawner.on_lane(bicycle, "b", "npc", "lane.main_east_a", 20.0, rng).lateral_m for _ in range(50)]
    assert max(sides) < 0
    drawn = [spawner.on_lane(bicycle, "b", "npc", "lane.main_east_a", 20.0, rng).speed_mps for _ in range(50)]
    assert bicycle.vehicle is not None and max(drawn) <= bicycle.vehicle.max_speed_mps
    assert (
        abs(np.mean([spawner.on_lane(car, "c", "npc", "lane.main_east_a", 20.0, rng).lateral_m for _ in range(50)]))
        < 0.1
    )
