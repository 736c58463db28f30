"""Which actors a scene's world holds, and how many instances of each: enough for every sample, no more."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from gear.values.errors import TownError
from gear.world.assets.library import ActorFacts, AssetLibrary
from gear.world.scene_spec import SceneSpec

EGO_ASSET = "car_saloon"

POOL_SLACK = 2.0
"""An asset has this many times the instances that its share of the largest crowd would be."""


def plan_pool(scene: SceneSpec, library: AssetLibrary) -> list[tuple[ActorFacts, int]]:
    """The ego car first, then vehicles and people with their counts.

    Raises:
        UnknownNameError: the town's vehicles hold no ego car.
        TownError: a vehicle is named like a pedestrian.
    """
    for name in library.vehicles.keys() & library.pedestrians.keys():
        problem = f"has the name of {library.pedestrians[name].path}, so records could not tell them apart; rename one"
        raise TownError(library.vehicles[name].path, problem)
    library.path("vehicle", EGO_ASSET)
    vehicles = vehicles_of(scene, library)
    pool = [(vehicles[EGO_ASSET], 1)]
    if scene.npc_vehicles.count[1]:
        pool += _shares(vehicles, scene.npc_vehicles.count[1])
    if scene.pedestrians.count[1]:
        pool += _shares(library.pedestrians, scene.pedestrians.count[1])
    return pool


def vehicles_of(scene: SceneSpec, library: AssetLibrary) -> dict[str, ActorFacts]:
    """A library's vehicles by name, as common as a scene has them."""
    mix = scene.npc_vehicles.mix
    return {
        name: replace(facts, weight=facts.weight * mix.get(facts.kind, 1.0)) for name, facts in library.vehicles.items()
    }


def _shares(actors: Mapping[str, ActorFacts], most: int) -> list[tuple[ActorFacts, int]]:
    total = sum(actor.weight for actor in actors.values())
    return [
        (actor, min(most, max(1, math.ceil(POOL_SLACK * most * actor.weight / total))))
        for actor in actors.values()
        if actor.weight > 0
    ]
