"""The pool of actors: enough for the largest crowd, by the weights of the scene's mix."""

from __future__ import annotations

from collections import Counter

from gear.testing.tiny_town import CLEAR, TINY_TOWN
from gear.values.resources import data_dir
from gear.world.assets.library import AssetLibrary
from gear.world.assets.scene_assets import read_scene_assets
from gear.world.compilation.actor_pool import plan_slots
from gear.world.compilation.world_plan import plan_world
from gear.world.scene_spec import NpcLimits, SceneSpec, TruckSpec, VehicleLimits

NOBODY = NpcLimits(count=(0, 0))


def test_the_pool_is_enough_for_the_largest_crowd() -> None:
    library = AssetLibrary.for_town(TINY_TOWN)
    scene = SceneSpec(npc_vehicles=VehicleLimits(count=(0, 9)), pedestrians=NpcLimits(count=(0, 30)))
    slots = plan_slots(scene, read_scene_assets(library, scene))
    assert (slots[0].body, slots[0].actor) == ("car_saloon_0", library.vehicles["car_saloon"])
    assert len({slot.body for slot in slots}) == len(slots)
    kinds = Counter(slot.actor.kind for slot in slots[1:])
    assert kinds["person"] >= 30 and kinds.total() - kinds["person"] >= 9
    nobody = SceneSpec(npc_vehicles=VehicleLimits(count=(0, 0)), pedestrians=NOBODY)
    (ego,) = plan_slots(nobody, read_scene_assets(library, nobody))
    assert ego == slots[0]


def test_a_mix_makes_kinds_more_common_wherever_a_vehicle_is_drawn() -> None:
    library = AssetLibrary.for_town(data_dir("mjcf") / "towns" / "town10.xml")
    mix = {"bus": 4.0, "car": 0.0}

    def slots(mix: dict[str, float]) -> tuple[list[str], Counter[str]]:
        limits = VehicleLimits(count=(0, 12), mix=mix)
        scene = SceneSpec(npc_vehicles=limits, pedestrians=NOBODY, truck=TruckSpec())
        plan = plan_world(library, scene, CLEAR)
        for slot in plan.slots:
            facts = slot.actor
            assert facts.weight == library.vehicles[facts.name].weight * mix.get(facts.kind, 1.0)
        *pool, carrier = plan.slots
        assert carrier.carries_surface and not any(slot.carries_surface for slot in pool)
        assert pool[0].actor.name == "car_saloon", "the ego car is there, whatever the mix"
        return [slot.actor.name for slot in pool[1:]], Counter(slot.actor.kind for slot in pool[1:])

    (mixed, kinds), (usual, _) = slots(mix), slots({})
    assert set(kinds) == {"van", "truck", "bus", "motorcycle", "bicycle"}
    (bus,) = {name for name in mixed if library.vehicles[name].kind == "bus"}
    assert mixed.count(bus) > 2 * usual.count(bus)
