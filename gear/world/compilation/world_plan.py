"""The plan of a world: all data that determine the world, before MJCF files are composed and compiled.

A world is made in three steps: its assets are read, its pool of actors is decided, and the world is composed and
compiled from this plan alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gear.values.scene import Weather
from gear.world.assets.library import AssetLibrary
from gear.world.assets.scene_assets import SceneAssets, read_scene_assets
from gear.world.compilation.actor_pool import Slot, plan_slots
from gear.world.scene_spec import SceneSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldPlan:
    """The plan of a world: all data that determine the compiled world.

    Attributes:
        assets: the assets of the scene.
        scene: boards or truck, and limits.
        weather: light and air.
        slots: the pool of actors.
    """

    assets: SceneAssets
    scene: SceneSpec
    weather: Weather
    slots: tuple[Slot, ...]

    @property
    def town(self) -> Path:
        """Path of the town's MJCF file."""
        return self.assets.library.town


def plan_world(library: AssetLibrary, scene: SceneSpec, weather: Weather) -> WorldPlan:
    """Plans a world: reads the assets of a scene and decides its pool of actors.

    Args:
        library: files of the town's assets.
        scene: the scene with its boards and trucks.
        weather: the weather.

    Returns:
        The plan, from which `compile_world` compiles the world.

    Raises:
        UnknownNameError: the town has no such board or truck, or no ego car.
        TownError: an actor's file breaks the conventions.
    """
    assets = read_scene_assets(library, scene)
    return WorldPlan(assets=assets, scene=scene, weather=weather, slots=plan_slots(scene, assets))
