"""Looks up everything that a collection config names (task, town, scene, split, weather, patch) without a renderer."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from gear.collecting.patch_sources import PatchSet, resolve_patch
from gear.config.collection import CollectionConfig, SplitConfig, WeatherConfig
from gear.config.load import load_simulation, split_of
from gear.config.nodes import Place
from gear.config.reader import located_errors, read_node
from gear.plugins.build import find
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import ConfigError, FieldError, UnknownNameError
from gear.values.resources import data_dir
from gear.values.scene import Weather
from gear.values.serial import is_places_field
from gear.world.assets.library import AssetLibrary
from gear.world.scene_library import SceneFile, read_scene_file
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.surface_carriers import check_scene_assets
from gear.world.weather.presets import PRESETS

ROOMY_FACTOR = 100
"""Factor on the limit of vehicles in scenes without a billboard, as in CARLA-GeAR: they use the whole town."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Named:
    """The objects that the names in a collection config refer to.

    Attributes:
        config: the config; a scene given as a YAML file is split into scene library and name.
        task: plugin of the task.
        options: options of the task.
        library: assets of the town.
        scene: scene description with billboards, truck and numbers of road users, limited by the simulation config.
        split: seed and number of samples of the split.
        weather: all parameters of the weather.
        patch: patches that the scene shows.
    """

    config: CollectionConfig
    task: PluginEntry
    options: Any
    library: AssetLibrary
    scene: SceneSpec
    split: SplitConfig
    weather: Weather
    patch: PatchSet


def look_up(config: CollectionConfig) -> Named:
    """Looks up every name in a collection config.

    Raises:
        UnknownNameError: a task, town, scene, split or weather is unknown; the message suggests a close name.
        ConfigError: such a name in a file is unknown; or a scene library or the options of the task cannot be read.
        PatchError: the patch cannot be used.
    """
    with located_errors(config.places, "scene"):
        config = with_scene_file(config)
    with located_errors(config.places, "task"):
        task = find("task", config.task)
    options = read_node(task.spec.config, config.options, "options")
    with located_errors(config.places, "town"):
        library = AssetLibrary.for_town(config.town)
    with located_errors(config.places, "simulation"):
        simulation = load_simulation(config.simulation)
    with located_errors(config.places, "scenes" if config.scenes else "town"):
        scenes = find_scenes(library, config.scenes)
    with located_errors(config.places, "scene"):
        scene = scenes.scene(config.scene)
        check_scene_assets(library, scene, f"scenes.{config.scene}")
    roomy = 1 if scene.boards else ROOMY_FACTOR
    scene = scene.capped(simulation.max_vehicles * roomy, simulation.max_pedestrians)
    scene = _mixed(scene.crowded(config.crowd), config)
    with located_errors(config.places, "split"):
        split = split_of(simulation, config.split)
    split = dataclasses.replace(
        split,
        seed=split.seed if config.seed is None else config.seed,
        samples=split.samples if config.samples is None else config.samples,
    )
    with located_errors(config.weather.places, "preset", "weather"):
        weather = find_weather(config.weather)
    surfaces = len(scene.boards) if scene.truck is None else 1
    with located_errors(config.places, "patch"):
        patch = resolve_patch(config.patch, surfaces=surfaces, seed=config.patch_seed)
    return Named(
        config=config,
        task=task,
        options=options,
        library=library,
        scene=scene,
        split=split,
        weather=weather,
        patch=patch,
    )


def _mixed(scene: SceneSpec, config: CollectionConfig) -> SceneSpec:
    """A scene whose vehicle mix is the product of its own mix and the config's.

    Raises:
        ConfigError: the product is out of range, or leaves no vehicle.
    """
    try:
        return scene.mixed(config.mix)
    except FieldError as error:
        place = config.places.get(error.field) or config.places.get("mix") or Place("collection")
        raise place.error(error.field, f"{error.problem} (with the scene's own mix)") from error


def with_scene_file(config: CollectionConfig) -> CollectionConfig:
    """Splits a scene given as a YAML file into scene library and scene name: `my.yml:corner`.

    The name may be omitted (`my.yml`) if the file holds only one scene. A scene that is only a name is not changed.

    Args:
        config: the collection config.

    Returns:
        The config with the path of the file in `scenes` and the name in `scene`.

    Raises:
        UnknownNameError: the file does not exist, or holds several scenes and none was named.
        ConfigError: the file cannot be read.
    """
    path, _, name = config.scene.rpartition(":") if ":" in config.scene else (config.scene, "", "")
    if not path.endswith((".yml", ".yaml")):
        return config
    names = scene_library(path).names
    if not name and len(names) > 1:
        raise UnknownNameError("scene", config.scene, names, f"(say which: --scene {path}:{names[0]})")
    return dataclasses.replace(config, scenes=path, scene=name or names[0])


def find_scenes(town: AssetLibrary, scenes: str = "") -> SceneFile:
    """Reads the scene library of a town, or the library with a given name or path.

    The scenes are checked one by one when they are requested, so an error in one scene does not affect the others.

    Args:
        town: assets of the town.
        scenes: name or path of the library; empty for the town's own.

    Raises:
        UnknownNameError: there is no such library.
        ConfigError: the library cannot be read, or is for another town.
    """
    file = scene_library(scenes or town.town_name)
    library = file.library
    if scenes and library.town != town.town_name:
        problem = f"its boards stand in {library.town}, not in {town.town_name}; name that town, or scenes of this one"
        raise library.places.get("town", Place(scenes)).error("town", problem)
    return file


def scene_library(name: str) -> SceneFile:
    """Reads a scene library, given by the name of its town or by the path of its YAML file.

    Raises:
        UnknownNameError: there is no such library.
        ConfigError: the library cannot be read.
    """
    folder, is_path = data_dir("configs") / "scenes", Path(name).suffix in (".yml", ".yaml")
    path = Path(name) if is_path else folder / f"{name}.yml"
    try:
        is_there = path.exists()
    except OSError as error:
        raise ConfigError(name, 0, 0, "", f"cannot read it: {error.strerror}") from error
    if not is_there and is_path:
        raise UnknownNameError("scene library", name, hint="(that file does not exist)")
    if not is_there:
        hint = "(write one and give its file, FILE.yml)"
        raise UnknownNameError("scene library for town", name, (p.stem for p in folder.glob("*.yml")), hint)
    return read_scene_file(path)


def find_weather(config: WeatherConfig) -> Weather:
    """The weather preset that a config names, with the parameters that the config changes.

    Raises:
        UnknownNameError: there is no such preset.
    """
    if config.preset not in PRESETS:
        raise UnknownNameError("weather", config.preset, PRESETS)
    changes: dict[str, Any] = {
        field.name: getattr(config, field.name)
        for field in dataclasses.fields(cast(Any, config))  # mypy sees no dataclass behind its decorator
        if field.name != "preset" and not is_places_field(field) and getattr(config, field.name) is not None
    }
    preset = PRESETS[config.preset]
    if all(getattr(preset, name) == value for name, value in changes.items()):
        return preset
    return dataclasses.replace(preset, name=f"{preset.name}*", **changes)
