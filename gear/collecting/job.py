"""A collection job: the config with all names resolved, as plain data that is sent to each worker."""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
from dataclasses import dataclass
from pathlib import Path

import cv2
import mujoco
import numpy as np

from gear.camera.response import response_for
from gear.collecting.devices import planned_renderer, planned_versions
from gear.collecting.lookup import look_up
from gear.collecting.patch_sources import PatchSet
from gear.config.collection import CollectionConfig, SplitConfig
from gear.config.dump import to_plain
from gear.config.nodes import Place
from gear.contracts.rendering import RendererInfo
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import SplitInfo
from gear.dataset.plan import Plan
from gear.plugins.build import blamed, build
from gear.plugins.catalogue import PluginEntry
from gear.render.probing import renderer_info
from gear.values.errors import ConfigError, FieldError
from gear.values.geometry import RigidTransform
from gear.values.scene import Weather
from gear.values.serial import Json, to_json
from gear.world.assets.asset_hash import assets_digest, key_points_digest
from gear.world.scene_spec import SceneSpec

KINDS = ("probes", "scans", "flow")
"""Kinds of additional files that a config may request for each sample; a plan lists only the requested ones."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Job:
    """A collection config with all names resolved.

    Attributes:
        config: the collection config with all defaults filled in.
        split: seed and number of samples of the split.
        scene: scene description with billboards, truck and numbers of road users, limited by the simulation config.
        weather: all parameters of the weather.
        patch: patches that the scene shows.
        root: folder of the dataset.
        plan: everything that decides the bytes of the samples.
        renderer: renderer, device and driver.
        task_notes: warnings about task options that may be unintended.
    """

    config: CollectionConfig
    split: SplitConfig
    scene: SceneSpec
    weather: Weather
    patch: PatchSet
    root: Path
    plan: Plan
    renderer: RendererInfo
    task_notes: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings about settings that may be unintended, one line each: options of the task, and patches that
        were made for another scene.
        """
        here = f"{self.plan.info.town}/{self.plan.info.scene}"
        if not self.patch.made_for or here in self.patch.made_for:
            return self.task_notes
        scenes = ", ".join(self.patch.made_for)
        return (*self.task_notes, f"the patches of {self.patch.source} were made for {scenes}; this is {here}")

    @property
    def frames(self) -> int:
        """The number of samples (single pictures) of the whole split: sequences times frames per sequence."""
        return self.split.samples * self.split.frames


def resolve(config: CollectionConfig) -> Job:
    """Looks up every name in a config and starts the renderer as a test, before any sample is rendered.

    Raises:
        UnknownNameError: a task, town, scene, split or weather is unknown; the message suggests a close name.
        ConfigError: a name in a file is unknown, a file or the task's options cannot be read, or the lens distortion
            does not fit the task's cameras.
        PatchError: the patch cannot be used.
        BackendError: the renderer cannot start on this machine.
    """
    named = look_up(config)
    spec, owner = named.task.spec, named.task.owner
    config, library, split, weather, patch = named.config, named.library, named.split, named.weather, named.patch
    _check_effects(config, named.task)
    _check_flow(config, split)
    info = SplitInfo(
        town=library.town_name, scene=config.scene, split=config.split, seed=split.seed, patch_label=patch.label
    )
    with blamed(named.task, "notes"):
        task_notes = tuple(spec.notes(named.options)) if isinstance(spec, TaskSpec) else ()
    renderer = renderer_info(config.renderer)
    response = response_for(renderer.name, weather)
    content: Json = {
        "town": library.town_name,
        "scene_name": config.scene,
        "split": config.split,
        "seed": split.seed,
        "frames": split.frames,
        "interval_s": split.interval_s,
        "scene": _scene_content(named.scene),
        "weather": to_json(weather),
        "renderer": planned_renderer(renderer, mixed=config.mixed_devices),
        "quality": config.quality,
        "camera": to_json(config.camera),
        "response": {"exposure": response.exposure, "contrast": response.contrast, "encoding": response.encoding},
        "assets": assets_digest(library),
        "versions": planned_versions(versions(), mixed=config.mixed_devices),
    }
    plan = Plan(
        task={"name": spec.name, "package": owner.package, "version": owner.version},
        options=to_plain(named.options),
        content=content,
        patch={"label": patch.label, "sha256": patch.digest},
        info=info,
        samples=split.samples * split.frames,
        auxiliary=tuple(kind for kind in KINDS if getattr(config, kind)),
        recipe=recipe_of(config),
        key_points=key_points_digest(library),
    )
    return Job(
        config=config,
        split=split,
        scene=named.scene,
        weather=weather,
        patch=patch,
        root=dataset_root(config, info, weather),
        plan=plan,
        renderer=renderer,
        task_notes=task_notes,
    )


def recipe_of(config: CollectionConfig) -> Json:
    """A collection's config as JSON without paths of this machine and without the patch, for the plan and the manifest
    of the dataset.
    """
    recipe: Json = to_plain(config)
    unused = [name for name in (*KINDS, "mixed_devices") if not getattr(config, name)]
    for name in ("root", "patch", "town", "scenes", "simulation", *unused):
        recipe.pop(name)
    return recipe


def _scene_content(scene: SceneSpec) -> Json:
    """The scene as part of the plan; a vehicle mix only where there is one, so that older datasets can be continued."""
    content: Json = to_json(scene)
    if not scene.npc_vehicles.mix:
        del content["npc_vehicles"]["mix"]
    return content


def _check_effects(config: CollectionConfig, task: PluginEntry) -> None:
    """Refuses camera effects that do not fit the task's cameras.

    Raises:
        ConfigError: names the effect's parameter, with its line where a file gives it.
    """
    effects = config.camera.active()
    if not effects:
        return
    product = build(task, config.options)
    with blamed(task, "rig"):
        rig = product.rig()
    for camera in rig.place(RigidTransform.from_yaw("world", "ego", (0.0, 0.0, 0.0), 0.0)):
        for effect in effects:
            try:
                effect.check(camera)
            except FieldError as error:
                place = config.places.get("camera")
                if place is not None and place.line:
                    raise place.error(f"camera.{error.field}", error.problem) from error
                raise ConfigError("camera", 0, 0, error.field, error.problem) from error


def _check_flow(config: CollectionConfig, split: SplitConfig) -> None:
    """Refuses optical flow of single pictures, which have no next frame.

    Raises:
        ConfigError: the split has no driving sequences, and the config asks for flow.
    """
    if config.flow and split.frames == 1:
        problem = f"split {config.split!r} has single pictures, and flow leads to the next frame; use --split video"
        raise config.places.get("flow", Place("collection")).error("flow", problem)


def dataset_root(config: CollectionConfig, info: SplitInfo, weather: Weather) -> Path:
    """The dataset's folder: the one in the config, or by default `data/<task>/<town>-<scene>-<weather>/<patch>`.

    Args:
        config: the collection config.
        info: metadata of the split: names of town and scene, and label of the patch.
        weather: all parameters of the weather. If they differ from a preset, the folder's name has a hash of them.
    """
    if config.root:
        return Path(config.root)
    name = weather.name
    if name.endswith("*"):
        name = f"{name[:-1]}-{hashlib.sha256(repr(weather).encode()).hexdigest()[:6]}"
    folders = (config.task, f"{info.town}-{info.scene}-{name}", info.patch_label)
    return Path("data", *(folder.replace("/", "-") for folder in folders))  # a scene may be called ../../x


def versions() -> dict[str, str]:
    """The versions of the packages that decide the bytes of pictures and labels, and the processor architecture
    (`machine`).
    """
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
