"""The drives of a benchmark: one call of `gear.drive` for each task, scene and weather.

Every network drives, alone and behind each defense, with the patches that the benchmark has made.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.config.dump import node_to_json
from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.tasks import NO_PATCH
from gear.driving.config import PATCH as PATCH_TWIN
from gear.driving.config import DriveConfig
from gear.driving.drives import plan_drives
from gear.plugins.build import NO_OPTIONS
from gear.values.errors import GearError
from gear.values.serial import Json
from gear.verbs.bench.config import DriveBench, flow_text
from gear.verbs.bench.plan import ADAPTIVE, PATCH, RANDOM, Plan, Step, Weather, calibration_arguments
from gear.verbs.bench.scenes import Scene, located
from gear.verbs.bench.validation import Candidate, TaskPlugins

BASE = "quick"
"""Drive config that the commands of the steps name; the settings of a step replace each of its keys."""

FOLDER = "drives"
"""Folder of all drives in the folder of a benchmark."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchDriver:
    """A driver of the benchmark: a controller, with the network and the defense through which it sees.

    Attributes:
        model, defense: names of network and defense in the bench config; None without one.
        controller: name of the controller plugin.
    """

    model: str | None
    defense: str | None
    controller: str


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlannedDrives:
    """The drives of one task in one scene and one weather.

    Attributes:
        task_plugins: networks and defenses of the task.
        scene: the scene.
        weather: label of the weather; "" if the benchmark has only one.
        is_adaptive: whether the twin `patch` shows the patches that were optimised against a network behind its
            defense; otherwise those against the network alone.
        out: folder of the results.
        drivers: drivers by their names in the results.
        config: the drive config, as JSON with all keys.
        inputs: folders of patches and calibration data that must exist first.
    """

    task_plugins: TaskPlugins
    scene: Scene
    weather: str
    is_adaptive: bool
    out: Path
    drivers: dict[str, BenchDriver]
    config: Json
    inputs: tuple[str, ...]

    def kind(self, twin: str) -> str:
        """The kind of patch that a twin shows, such as `adaptive patch`."""
        return ADAPTIVE if self.is_adaptive and twin == PATCH_TWIN else twin


def every_step(plan: Plan) -> list[Step]:
    """All steps of a benchmark: its collections, attacks and evaluations, followed by its drives."""
    drives = [_step(planned, plan) for planned in planned_drives(plan)]
    return [*plan.steps(), *drives]


def planned_drives(plan: Plan) -> Iterator[PlannedDrives]:
    """Yields the drives of a benchmark, by task, scene and weather; none if the config has no key `drives`."""
    asked = plan.config.drives
    if asked is None:
        return
    for task_plugins in plan.plugins_of_tasks:
        for scene, weather in plan.places():
            yield _planned(plan, asked, task_plugins, (scene, weather), adaptive=False)
            if len(plan.adaptive_defenses(task_plugins)) > 1:
                yield _planned(plan, asked, task_plugins, (scene, weather), adaptive=True)


def check_drives(plan: Plan, node: Node) -> None:
    """Checks the drives of a benchmark before its first step: controllers, scenarios, options and places.

    Patches and calibration data, which other steps make, are not checked.

    Args:
        plan: plan of the benchmark.
        node: YAML tree of the bench config, for positions in error messages.

    Raises:
        ConfigError: something does not exist or does not fit.
    """
    for planned in planned_drives(plan):
        drivers = {
            label: {key: value for key, value in one.items() if key != "patch"}
            for label, one in planned.config["drivers"].items()
        }
        config = planned.config | {"drivers": drivers, "twins": [NO_PATCH]}
        try:
            plan_drives(read_node(DriveConfig, with_overrides(NO_OPTIONS, settings(config))), planned.out)
        except GearError as error:
            raise located(node, error, "drives") from error


def settings(config: Json) -> tuple[str, ...]:
    """The keys of a drive config as `KEY=VALUE` texts, one per key, with values in YAML's flow style."""
    return tuple(f"{key}={flow_text(value)}" for key, value in config.items())


def _step(planned: PlannedDrives, plan: Plan) -> Step:
    what = f", {planned.weather}" if planned.weather else ""
    what += " with adaptive patches" if planned.is_adaptive else ""
    return Step(
        verb="drive",
        title=f"drive by {planned.task_plugins.name} in {planned.scene.label}{what}",
        arguments={
            "config": BASE,
            "out": str(planned.out),
            "settings": settings(planned.config),
            **plan.workers,
        },
        inputs=planned.inputs,
    )


def _planned(
    plan: Plan, asked: DriveBench, task_plugins: TaskPlugins, place: tuple[Scene, Weather], *, adaptive: bool
) -> PlannedDrives:
    """The drives of a task in a scene and a weather; all drivers with the patches against networks alone, or with
    adaptive patches those behind a defense that has them.
    """
    scene, weather = place
    controller = asked.controllers.get(task_plugins.name, f"{task_plugins.name}_baseline")
    pictures = node_to_json(with_overrides(NO_OPTIONS, plan.picture_settings(task_plugins)))
    options = pictures.pop("options", {})
    guards = plan.adaptive_defenses(task_plugins)[1:] if adaptive else task_plugins.guards
    drivers: dict[str, BenchDriver] = {}
    configs: dict[str, Json] = {}
    inputs: list[str] = []
    for model in task_plugins.models:
        for defense in guards:
            label = model.label if defense is None else f"{model.label}-behind-{defense.label}"
            if label in configs:
                raise GearError(f"drives: two drivers would be called {label!r}; rename a network or a defense")
            patch = plan.patch(task_plugins, scene, plan.name(model, defense if adaptive else None))
            guard = _guard(plan, task_plugins, model, defense)
            configs[label] = {
                "controller": controller,
                "task": task_plugins.name,
                "model": model.plugin,
                "model_set": _plain(model),
                "options": options,
                "patch": str(patch),
                **guard,
            }
            inputs += [str(patch), *(guard[name] for name in ("calibration", "calibration_patched") if name in guard)]
            drivers[label] = BenchDriver(
                model=model.label, defense=None if defense is None else defense.label, controller=controller
            )
    for name in () if adaptive else asked.references:
        configs[name], drivers[name] = {"controller": name}, BenchDriver(model=None, defense=None, controller=name)
    folder = Path(f"{scene.label}-adaptive" if adaptive else scene.label)
    label = weather.label if len(plan.weathers) > 1 else ""
    return PlannedDrives(
        task_plugins=task_plugins,
        scene=scene,
        weather=label,
        is_adaptive=adaptive,
        out=plan.root / FOLDER / task_plugins.folder / folder / label,
        drivers=drivers,
        config={
            "drivers": configs,
            "towns": {scene.town: [scene.name]},
            "scenarios": {name: list(speeds) for name, speeds in asked.scenarios.items()},
            "library": asked.library,
            "twins": [PATCH] if adaptive else [NO_PATCH, RANDOM, PATCH],
            "repeats": asked.repeats,
            "seed": plan.config.seed,
            "weather": weather.parameters,
            "crowd": asked.crowd,
            "video": asked.video,
            "open_loop": asked.open_loop,
            "collect": pictures,
        },
        inputs=tuple(dict.fromkeys(inputs)),
    )


def _guard(plan: Plan, task_plugins: TaskPlugins, model: Candidate, defense: Candidate | None) -> dict[str, Any]:
    """The keys of a driver that name its defense with its calibration data; empty without a defense."""
    guard = plan.guard(task_plugins, model, defense)
    if guard is None or defense is None:
        return {}
    keys = {name: str(root) for name, root in calibration_arguments(guard).items()}
    return {"defense": defense.plugin, "defense_set": _plain(defense), **keys}


def _plain(candidate: Candidate) -> Json:
    return node_to_json(with_overrides(NO_OPTIONS, candidate.settings))
