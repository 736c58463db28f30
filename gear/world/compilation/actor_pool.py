"""The pool of actors in a scene's world, which is compiled into the world before samples are drawn.

It contains just enough instances of each asset for every sample; a sample uses some of them.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from gear.world.assets.library import ActorFacts
from gear.world.assets.scene_assets import SceneAssets
from gear.world.scene_spec import SceneSpec

PARKED_DEPTH_M = 60.0
"""Depth in metres below the town's ground at which actors are placed that a sample does not use."""

POOL_SLACK = 2.0
"""Factor on the number of instances of an asset. The number without this factor is the asset's share of the largest
crowd.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """One entry of the pool of actors: an instance of an asset that samples may use.

    Attributes:
        body: name of its body in the render model and in the placement model.
        actor: metadata of its asset.
        carries_surface: whether the actor carries a face with its own texture, which can show a patch.
    """

    body: str
    actor: ActorFacts
    carries_surface: bool = False


def plan_slots(scene: SceneSpec, assets: SceneAssets) -> tuple[Slot, ...]:
    """Decides which actors a world contains: the ego car, vehicles, people, and the vehicle that carries the patch, in
    this order.

    Args:
        scene: the scene; its largest counts of vehicles and people determine the size of the pool.
        assets: the assets of the same scene.
    """
    counts: Counter[str] = Counter({assets.ego.name: 1})
    actors = {assets.ego.name: assets.ego}
    for candidates, limits in ((assets.vehicles, scene.npc_vehicles), (assets.pedestrians, scene.pedestrians)):
        for name, count in _instances(candidates, limits.count[1]).items():
            counts[name] += count
            actors[name] = candidates[name]
    slots = [
        Slot(body=f"{name}_{index}", actor=actors[name]) for name, count in counts.items() for index in range(count)
    ]
    if assets.carrier is not None:
        slots.append(Slot(body="carrier", actor=assets.carrier, carries_surface=True))
    return tuple(slots)


def _instances(actors: Mapping[str, ActorFacts], largest_count: int) -> dict[str, int]:
    """Number of instances of each asset that a crowd of at most `largest_count` actors needs."""
    if not largest_count:
        return {}
    total = sum(actor.weight for actor in actors.values())
    return {
        name: min(largest_count, max(1, math.ceil(POOL_SLACK * largest_count * actor.weight / total)))
        for name, actor in actors.items()
        if actor.weight > 0
    }
