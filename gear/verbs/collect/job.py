"""One run of `collect`, resolved: everything a worker needs, as data."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib.metadata
import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import mujoco
import numpy as np

from gear.camera.optics import lens_map
from gear.camera.response import response_for
from gear.config.collection import CollectionConfig, SplitConfig, WeatherConfig
from gear.config.dump import to_plain
from gear.config.load import load_simulation, split_of
from gear.config.nodes import parse_file
from gear.config.reader import holds_places, read_node, told_at
from gear.contracts.rendering import RendererInfo
from gear.contracts.tasks import SplitInfo
from gear.dataset.plan import Plan
from gear.plugins.build import blamed, build, find
from gear.plugins.catalogue import Found
from gear.render.probing import renderer_info
from gear.values.errors import ConfigError, UnknownNameError
from gear.values.resources import data_dir
from gear.values.scene import Weather
from gear.values.serial import Json, to_json
from gear.verbs.collect.patches import PatchSet, resolve_patch
from gear.world.assets import AssetLibrary
from gear.world.digest import assets_digest
from gear.world.scene_spec import SceneLibrary, SceneSpec
from gear.world.weather import PRESETS

ROOMY_FACTOR = 100
"""Scenes without a board take so many times the vehicles, as in the original: they are not bound to one corner."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Job:
    """A resolved collection.

    Attributes:
        config: as the user wrote it, defaults filled in.
        split: seeds and counts.
        scene: boards, truck and limits, capped by the simulation config.
        weather: every parameter.
        patch: pictures of this run.
        root: folder of the dataset.
        plan: what decides the bytes.
        renderer: who renders.
    """

    config: CollectionConfig
    split: SplitConfig
    scene: SceneSpec
    weather: Weather
    patch: PatchSet
    root: Path
    plan: Plan
    renderer: RendererInfo

    @property
    def note(self) -> str:
        """What the user may not have meant, or nothing: a patch in a foreign scene is an experiment or a slip."""
        here = f"{self.plan.info.town}/{self.plan.info.scene}"
        if not self.patch.made_for or here in self.patch.made_for:
            return ""
        return f"the patches of {self.patch.source} were made for {', '.join(self.patch.made_for)}; this is {here}"

    @property
    def frames(self) -> int:
        """Samples of the whole split."""
        return self.split.samples * self.split.frames


def resolve(config: CollectionConfig) -> Job:
    """Looks up every name in a config, before anything is rendered.

    Raises:
        UnknownNameError: a task, town, scene, split or weather is not known; says what may have been meant.
        ConfigError: likewise, of a name that a file has; a scene library or the task's options cannot be read, or the
            lens folds its pictures over.
        PatchError: the patch cannot be used.
        BackendError: the renderer cannot start here.
    """
    with told_at(config.places, "scene"):
        config = with_scene_file(config)
    with told_at(config.places, "task"):
        found = find("task", config.task)
    options = read_node(found.spec.config, config.options, "options")
    _check_lens(config, found)
    with told_at(config.places, "town"):
        library = AssetLibrary.for_town(config.town)
    with told_at(config.places, "simulation"):
        simulation = load_simulation(config.simulation)
    with told_at(config.places, "scenes" if config.scenes else "town"):
        scenes = find_scenes(config, library.town_name)
    with told_at(config.places, "scene"):
        scene = find_scene(config, scenes)
    roomy = 1 if scene.boards else ROOMY_FACTOR
    scene = scene.capped(simulation.max_vehicles * roomy, simulation.max_pedestrians).crowded(config.crowd)
    with told_at(config.places, "split"):
        split = split_of(simulation, config.split)
    split = dataclasses.replace(
        split,
        seed=split.seed if config.seed is None else config.seed,
        samples=split.samples if config.samples is None else config.samples,
    )
    with told_at(config.weather.places, "preset", "weather"):
        weather = find_weather(config.weather)
    surfaces = len(scene.boards) if scene.truck is None else 1
    with told_at(config.places, "patch"):
        patch = resolve_patch(config.patch, surfaces=surfaces, seed=config.patch_seed)
    info = SplitInfo(
        town=library.town_name, scene=config.scene, split=config.split, seed=split.seed, patch_label=patch.label
    )
    renderer = renderer_info(config.renderer)
    response = response_for(renderer.name, weather)
    content: Json = {
        "town": library.town_name,
        "scene_name": config.scene,
        "split": config.split,
        "seed": split.seed,
        "frames": split.frames,
        "interval_s": split.interval_s,
        "scene": to_json(scene),
        "weather": to_json(weather),
        "renderer": to_json(renderer),
        "quality": config.quality,
        "camera": to_json(config.camera),
        "response": {"exposure": response.exposure, "contrast": response.contrast, "encoding": response.encoding},
        "assets": assets_digest(library),
        "versions": versions(),
    }
    plan = Plan(
        task={"name": found.spec.name, "package": found.owner.package, "version": found.owner.version},
        options=to_plain(options),
        content=content,
        patch={"label": patch.label, "sha256": patch.digest},
        info=info,
        samples=split.samples * split.frames,
        auxiliary=("probes",) if config.probes else (),
    )
    return Job(
        config=config,
        split=split,
        scene=scene,
        weather=weather,
        patch=patch,
        root=dataset_root(config, info, weather),
        plan=plan,
        renderer=renderer,
    )


def _check_lens(config: CollectionConfig, task: Found) -> None:
    lens = config.camera.lens
    if not lens.bends:
        return
    product = build(task, config.options)
    with blamed(task, "rig"):
        rig = product.rig()
    for camera in rig.cameras:
        try:
            lens_map(lens, camera.width_px, camera.height_px, camera.intrinsics.focal_px)
        except ValueError as error:
            problem = f"{error}; take k1 and k2 nearer to 0, or a narrower field of view"
            raise ConfigError("camera", 0, 0, "lens", problem) from error


def with_scene_file(config: CollectionConfig) -> CollectionConfig:
    """Takes a scene given as a file apart: `my.yml:corner`, or `my.yml` where it holds only one.

    Raises:
        UnknownNameError: the file holds several scenes and none was named.
    """
    path, _, name = config.scene.rpartition(":") if ":" in config.scene else (config.scene, "", "")
    if not path.endswith((".yml", ".yaml")):
        return config
    scenes = scene_library(path).scenes
    if not name and len(scenes) > 1:
        raise UnknownNameError("scene", config.scene, scenes, f"(say which: --scene {path}:{next(iter(scenes))})")
    return dataclasses.replace(config, scenes=path, scene=name or next(iter(scenes)))


def find_scenes(config: CollectionConfig, town: str) -> SceneLibrary:
    """The scene library that the config names, or the town's own."""
    library = scene_library(config.scenes or town)
    if config.scenes and library.town != town:
        raise ConfigError(
            config.scenes, 0, 0, "town", f"its boards stand in {library.town}, not in {town}; use --town {library.town}"
        )
    return library


def find_scene(config: CollectionConfig, library: SceneLibrary) -> SceneSpec:
    """The scene by name."""
    if config.scene not in library.scenes:
        raise UnknownNameError(f"scene of {library.town}", config.scene, library.scenes)
    return library.scenes[config.scene]


def scene_library(name: str) -> SceneLibrary:
    """A scene library by the name of its town, or by path.

    Raises:
        UnknownNameError: there is none.
        ConfigError: it cannot be read.
    """
    path = Path(name)
    if path.suffix not in (".yml", ".yaml"):
        folder = data_dir("configs") / "scenes"
        path = folder / f"{name}.yml"
        if not path.is_file():
            hint = "(write one and give it with --set scenes=FILE.yml)"
            raise UnknownNameError("scene library for town", name, (p.stem for p in folder.glob("*.yml")), hint)
    return read_node(SceneLibrary, parse_file(path))


def find_weather(config: WeatherConfig) -> Weather:
    """The preset with what the config changes in it.

    Raises:
        UnknownNameError: there is no such preset.
    """
    if config.preset not in PRESETS:
        raise UnknownNameError("weather", config.preset, PRESETS)
    changes: dict[str, Any] = {
        field.name: getattr(config, field.name)
        for field in dataclasses.fields(config)
        if field.name != "preset" and not holds_places(field) and getattr(config, field.name) is not None
    }
    preset = PRESETS[config.preset]
    if all(getattr(preset, name) == value for name, value in changes.items()):
        return preset
    return dataclasses.replace(preset, name=f"{preset.name}*", **changes)


def dataset_root(config: CollectionConfig, info: SplitInfo, weather: Weather) -> Path:
    """Where the dataset goes: what the user said, or `data/<task>/<town>-<scene>-<weather>/<patch>`."""
    if config.root:
        return Path(config.root)
    name = weather.name
    if name.endswith("*"):
        name = f"{name[:-1]}-{hashlib.sha256(repr(weather).encode()).hexdigest()[:6]}"
    folders = (config.task, f"{info.town}-{info.scene}-{name}", info.patch_label)
    return Path("data", *(folder.replace("/", "-") for folder in folders))  # a scene may be called ../../x


def versions() -> dict[str, str]:
    """Of what decides the bytes of pictures and labels."""
    return {
        "gear": _version("mujoco-gear"),
        "mujoco": mujoco.__version__,
        "dm_control": _version("dm-control"),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "machine": platform.machine(),
    }


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "source"
