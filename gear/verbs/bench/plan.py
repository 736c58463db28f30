"""The plan of a benchmark: the ordered calls of `collect`, `attack` and `evaluate`, and the evaluations that the
tables need.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from gear.config.collection import WeatherConfig
from gear.config.dump import to_plain
from gear.contracts.evaluation import Maskable, Reports
from gear.contracts.specs import AttackSpec
from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.measuring.guard import Guard
from gear.measuring.reports import OUTSIDE_PATCH
from gear.metrics.critical_classes import CRITICAL
from gear.metrics.obstacle_depth import NEAREST_OBSTACLE
from gear.plugins.build import build, find
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.bench.config import BenchConfig, settings_of
from gear.verbs.bench.existing_patches import PATCHES, ExistingPatches
from gear.verbs.bench.scenes import Scene
from gear.verbs.bench.validation import Candidate, TaskPlugins

RANDOM, PATCH, ADAPTIVE = RANDOM_PATCH, "patch", "adaptive patch"
"""Kinds of patches: random, optimised against the network, optimised against the network with its defense."""

SPLITS = {"attack": "train", "choose": "val", "measure": "test", "calibrate": "finetuning"}
"""Name of the dataset split that is collected for each purpose."""

Verb = Literal["collect", "attack", "evaluate", "drive"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One step of a benchmark: a call of `gear.collect`, `gear.attack`, `gear.evaluate` or `gear.drive`.

    A step resumes an interrupted run, and returns quickly if its results exist.

    Attributes:
        verb: name of the called function.
        title: one line for the progress display.
        arguments: keyword arguments of the call.
        inputs: folders, made by other steps, that the step reads and that are named only inside its `settings`.
    """

    verb: Verb
    title: str
    arguments: dict[str, Any]
    inputs: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlannedEvaluation:
    """One evaluation of the benchmark: a network, alone or guarded by a defense, in all scenes.

    Attributes:
        task_plugins: all networks and defenses of the task.
        model, defense: the network and the defense that are evaluated together; `defense` is None for the network
            alone.
        out: folder of the evaluation.
        pools: roots of the datasets of all scenes, by kind of patch, such as `none`, `random` or `patch`.
    """

    task_plugins: TaskPlugins
    model: Candidate
    defense: Candidate | None
    out: Path
    pools: dict[str, list[Path]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """A weather of the benchmark.

    Attributes:
        label: name of the weather in folders and tables.
        settings: `KEY=VALUE` texts that select the weather in a collection.
        parameters: the preset and the parameters that differ from it, as JSON.
    """

    label: str
    settings: tuple[str, ...]
    parameters: Json


class Plan:
    """All steps of a benchmark, and the folders of their results.

    Args:
        config: the bench config.
        scenes: scenes in which networks are measured.
        calibration: scene in which defenses are calibrated; None if the config names none.
        plugins_of_tasks: networks and defenses of each task.
        attack: spec of the attack that makes the patches.
        root: folder of the benchmark.
        workers: arguments of each collection that name its workers: `workers`, and `engine` and `address` if they are
            not the default ones.
    """

    def __init__(
        self,
        config: BenchConfig,
        *,
        scenes: tuple[Scene, ...],
        calibration: Scene | None,
        plugins_of_tasks: tuple[TaskPlugins, ...],
        attack: AttackSpec[Any],
        root: Path,
        workers: Mapping[str, str | int],
    ) -> None:
        """Keeps the inputs of the benchmark, which the class describes; nothing is checked or written."""
        self.config, self.plugins_of_tasks, self.scenes = config, plugins_of_tasks, scenes
        self.weathers = tuple(weathers(config.weathers))
        self._calibration, self._attack, self.root = calibration, attack, root
        self.workers = workers
        self.existing: dict[Path, Path] = {}
        """Folders of patches that exist already, by the folder in which an attack would write such patches."""

    def take_existing(self, source: ExistingPatches) -> None:
        """Uses all patches that a source has in place of attacks.

        Args:
            source: the patches that exist already.
        """
        scenes = (*self.scenes, *([] if self._calibration is None else [self._calibration]))
        for one in self.plugins_of_tasks:
            for model, scene in itertools.product(one.models, scenes):
                for defense in self.adaptive_defenses(one) if scene in self.scenes else (None,):
                    name = self.name(model, defense)
                    folder = source.find(one, model, name, scene)
                    if folder is not None:
                        self.existing[self._made_patch(one, scene, name)] = folder

    def _is_attacked(self, task_plugins: TaskPlugins, scene: Scene, name: str) -> bool:
        """Whether the patches against a network, alone or with a defense, do not exist yet."""
        return self._made_patch(task_plugins, scene, name) not in self.existing

    def steps(self) -> Iterator[Step]:
        """Yields all steps in an order in which each step comes after the steps that it depends on."""
        for task_plugins in self.plugins_of_tasks:
            for scene in self.scenes:
                yield from self._pictures(task_plugins, scene)
            learning = [defense for defense in task_plugins.defenses if defense.needs_calibration]
            if self._calibration is not None and learning:
                yield from self._calibration_data(task_plugins, self._calibration)
            for scene in self.scenes:
                for model in task_plugins.models:
                    yield from self._patch(task_plugins, scene, model)
            for planned in self.planned_evaluations(task_plugins):
                yield self.evaluation(planned)

    def planned_evaluations(self, task_plugins: TaskPlugins) -> Iterator[PlannedEvaluation]:
        """Yields the evaluations of a task: one per network without a defense, and one per network and defense. Nothing
        is run.

        Args:
            task_plugins: networks and defenses of the task.
        """
        for model in task_plugins.models:
            for defense in task_plugins.guards:
                shown = {NO_PATCH: NO_PATCH, RANDOM: RANDOM, PATCH: model.label}
                if defense is not None and self._is_adaptive(defense):
                    shown[ADAPTIVE] = self.name(model, defense)
                if defense is None and self.config.transfer:
                    shown |= {f"{PATCH} of {one.label}": one.label for one in task_plugins.models if one is not model}
                yield PlannedEvaluation(
                    task_plugins=task_plugins,
                    model=model,
                    defense=defense,
                    out=self.root / "evaluations" / task_plugins.folder / self.name(model, defense),
                    pools={
                        kind: [self.pictures(task_plugins, *place, patch) for place in self.places()]
                        for kind, patch in shown.items()
                    },
                )

    def places(self) -> list[tuple[Scene, Weather]]:
        """Returns every (scene, weather) pair, in the order of the datasets of a pool."""
        return [(scene, weather) for scene in self.scenes for weather in self.weathers]

    def pictures(self, task_plugins: TaskPlugins, scene: Scene, weather: Weather, patch: str) -> Path:
        """Returns the root of the pictures on which networks are measured; `patch` is `none`, `random` or the name
        of the attacked network.

        Args:
            task_plugins: networks and defenses of the task.
            scene: the measured scene.
            weather: the weather.
            patch: `none`, `random` or the name of the attacked network.
        """
        kind = patch if patch in (NO_PATCH, RANDOM) else f"patch-{patch}"
        return self._place(task_plugins, scene) / weather.label / kind

    def patch(self, task_plugins: TaskPlugins, scene: Scene, name: str) -> Path:
        """Returns the folder of the patches that were optimised in a scene: by this benchmark, or before it.

        Args:
            task_plugins: networks and defenses of the task.
            scene: the scene.
            name: name of the attacked network, or of a network with a defense, as `Plan.name` returns it.
        """
        made = self._made_patch(task_plugins, scene, name)
        return self.existing.get(made, made)

    def _made_patch(self, task_plugins: TaskPlugins, scene: Scene, name: str) -> Path:
        """The folder into which an attack of this benchmark writes its patches."""
        return self.root / PATCHES / task_plugins.folder / name / scene.label

    def adaptive_defenses(self, task_plugins: TaskPlugins) -> tuple[Candidate | None, ...]:
        """Returns the defenses that attacks on a network take into account; None stands for the attack on the network
        alone.

        Defenses are included only if the config asks for adaptive patches, and only those that support the attack.

        Args:
            task_plugins: networks and defenses of the task.
        """
        return (None, *(defense for defense in task_plugins.defenses if self._is_adaptive(defense)))

    @staticmethod
    def name(model: Candidate, defense: Candidate | None) -> str:
        """Returns the name of a network with its defense, `<network>+<defense>`, for tables, folders and patches.

        Args:
            model: the network.
            defense: the defense; None for the network alone, whose name is `<network>`.
        """
        return model.label if defense is None else f"{model.label}+{defense.label}"

    def picture_settings(self, task_plugins: TaskPlugins) -> tuple[str, ...]:
        """Returns the `KEY=VALUE` settings that all collections of a task share: those for all tasks, then those of
        this task.

        Args:
            task_plugins: networks and defenses of the task.
        """
        return (*settings_of(self.config.collect), *settings_of(self.config.tasks[task_plugins.name].collect))

    def seed(self, purpose: str) -> int:
        """Returns the seed of the pictures for one purpose, such as `attack` or `measure`; the samples of two
        purposes differ.
        """
        return int(derive_rng(self.config.seed, "bench", purpose).integers(1 << 31))

    @property
    def calibration(self) -> Scene | None:
        """The scene in which defenses are calibrated; None if the config names none."""
        return self._calibration

    def _place(self, task_plugins: TaskPlugins, scene: Scene) -> Path:
        return self.root / "data" / task_plugins.folder / scene.label

    def _is_adaptive(self, defense: Candidate) -> bool:
        return self.config.adaptive and defense.supports_adaptive_attack(self._attack)

    def _pictures(self, task_plugins: TaskPlugins, scene: Scene) -> Iterator[Step]:
        guarded = itertools.product(task_plugins.models, self.adaptive_defenses(task_plugins))
        is_attacked = any(self._is_attacked(task_plugins, scene, self.name(*pair)) for pair in guarded)
        for weather in self.weathers:
            if is_attacked:
                yield from self._grounds(task_plugins, scene, weather)
            for patch in (NO_PATCH, RANDOM):
                out = self.pictures(task_plugins, scene, weather, patch)
                yield self._collect(task_plugins, scene, weather, "measure", out, patch=patch)

    def _grounds(self, task_plugins: TaskPlugins, scene: Scene, weather: Weather) -> Iterator[Step]:
        """Yields the collections of the pictures on which a patch is optimised, and of those on which its best
        step is chosen.
        """
        for purpose in ("attack", "choose"):
            yield self._collect(
                task_plugins, scene, weather, purpose, self._ground(task_plugins, scene, weather, purpose)
            )

    def _ground(self, task_plugins: TaskPlugins, scene: Scene, weather: Weather, purpose: str) -> Path:
        return self._place(task_plugins, scene) / weather.label / purpose

    def _patch(self, task_plugins: TaskPlugins, scene: Scene, model: Candidate) -> Iterator[Step]:
        """Yields the steps for a network's patch, its adaptive patches, and the rendered pictures of both."""
        for defense in self.adaptive_defenses(task_plugins):
            name = self.name(model, defense)
            if self._is_attacked(task_plugins, scene, name):
                yield self._attacked(task_plugins, scene, model, defense, self.weathers)
            for weather in self.weathers:
                out, patch = self.pictures(task_plugins, scene, weather, name), self.patch(task_plugins, scene, name)
                yield self._collect(task_plugins, scene, weather, "measure", out, patch=patch)

    def _calibration_data(self, task_plugins: TaskPlugins, scene: Scene) -> Iterator[Step]:
        """Yields the steps that make the calibration data of defenses.

        The calibration data are pictures of the calibration scene without a patch, and the same pictures with each
        network's patch.
        """
        weather = self.weathers[0]
        if any(self._is_attacked(task_plugins, scene, model.label) for model in task_plugins.models):
            yield from self._grounds(task_plugins, scene, weather)
        yield self._collect(task_plugins, scene, weather, "calibrate", self._calibration_folder(task_plugins, NO_PATCH))
        for model in task_plugins.models:
            if self._is_attacked(task_plugins, scene, model.label):
                yield self._attacked(task_plugins, scene, model, None, (weather,))
            out, patch = (
                self._calibration_folder(task_plugins, model.label),
                self.patch(task_plugins, scene, model.label),
            )
            yield self._collect(task_plugins, scene, weather, "calibrate", out, patch=patch)

    def _calibration_folder(self, task_plugins: TaskPlugins, patch: str) -> Path:
        assert self._calibration is not None
        kind = NO_PATCH if patch == NO_PATCH else f"patch-{patch}"
        return self._place(task_plugins, self._calibration) / self.weathers[0].label / f"calibrate-{kind}"

    def _collect(
        self,
        task_plugins: TaskPlugins,
        scene: Scene,
        weather: Weather,
        purpose: str,
        out: Path,
        *,
        patch: str | Path = NO_PATCH,
    ) -> Step:
        named = patch if isinstance(patch, str) else out.name.partition("patch-")[2]
        shown = "" if patch == NO_PATCH else f", {named} patch"
        arguments = {
            "task": task_plugins.name,
            "town": scene.town,
            "scene": scene.name,
            "split": SPLITS[purpose],
            "seed": self.seed(purpose),
            "samples": getattr(self.config.samples, purpose),
            "patch": str(patch),
            "out": str(out),
            "probes": purpose in ("attack", "choose") and self.config.attack.compositor == "transport",
            "settings": (
                *self.picture_settings(task_plugins),
                *weather.settings,
                f"patch_seed={self.seed(RANDOM)}",
            ),
            **self.workers,
        }
        return Step(
            verb="collect",
            title=f"collect {task_plugins.name} in {scene.label} {weather.label} to {purpose}{shown}",
            arguments={key: value for key, value in arguments.items() if value is not False},
        )

    def _attacked(
        self,
        task_plugins: TaskPlugins,
        scene: Scene,
        model: Candidate,
        defense: Candidate | None,
        shown: tuple[Weather, ...],
    ) -> Step:
        attack, name = self.config.attack, self.name(model, defense)
        return Step(
            verb="attack",
            title=f"attack {name} of {task_plugins.name} in {scene.label}",
            arguments={
                "model": model.plugin,
                "data": [str(self._ground(task_plugins, scene, weather, "attack")) for weather in shown],
                "val": [str(self._ground(task_plugins, scene, weather, "choose")) for weather in shown],
                "out": str(self.patch(task_plugins, scene, name)),
                "attack": attack.plugin,
                **({"queries": attack.queries} if attack.queries else {"steps": attack.steps}),
                "settings": tuple(settings_of(attack.set)),
                "model_settings": model.settings,
                **_keywords(self.guard(task_plugins, model, defense)),
                "compositor": attack.compositor,
                "seed": self.config.seed,
            },
        )

    def evaluation(self, planned: PlannedEvaluation) -> Step:
        """Returns the step that measures a network, alone or behind a defense, on all of its datasets.

        Args:
            planned: network, defense and datasets of the evaluation.
        """
        return Step(
            verb="evaluate",
            title=f"evaluate {self.name(planned.model, planned.defense)} in {planned.task_plugins.name}",
            arguments={
                "model": planned.model.plugin,
                "model_settings": planned.model.settings,
                **_keywords(self.guard(planned.task_plugins, planned.model, planned.defense)),
                "data": [str(root) for roots in planned.pools.values() for root in roots],
                "reports": reports_of(planned.task_plugins),
                "out": str(planned.out),
                "seed": self.config.seed,
                "pools": {name: [str(root) for root in roots] for name, roots in planned.pools.items()},
            },
        )

    def guard(self, task_plugins: TaskPlugins, model: Candidate, defense: Candidate | None) -> Guard | None:
        """Returns a defense of one network with the calibration data that it needs; None for no defense.

        Args:
            task_plugins: networks and defenses of the task.
            model: the network.
            defense: the defense; None for the network alone.
        """
        if defense is None:
            return None
        guard = Guard(defense=defense.plugin, settings=defense.settings)
        if not defense.needs_calibration:
            return guard
        return replace(
            guard,
            calibration=str(self._calibration_folder(task_plugins, NO_PATCH)),
            calibration_patched=str(self._calibration_folder(task_plugins, model.label)),
        )


def reports_of(task_plugins: TaskPlugins) -> tuple[str, ...]:
    """Returns the names of the metric reports that the tables need: the report with the task's main metric,
    `outside_patch`, for depth `nearest_obstacle`, and for semantic segmentation `critical`.

    Args:
        task_plugins: networks and defenses of the task.
    """
    product = build(find("task", task_plugins.name))
    metric_report, dot, _ = task_plugins.task.metric.partition(".")
    wanted = [metric_report] if dot and isinstance(product, Reports) else []
    own = product.reports() if isinstance(product, Reports) else {}
    wanted += [name for name in (NEAREST_OBSTACLE, CRITICAL) if name in own and name not in wanted]
    return (*wanted, *([OUTSIDE_PATCH] if isinstance(product, Maskable) else []))


def weathers(configs: tuple[WeatherConfig, ...]) -> Iterator[Weather]:
    """Yields the weathers of the config, each with a unique label and its collection settings."""
    seen: set[str] = set()
    for one in configs:
        given = {name: value for name, value in to_plain(one).items() if value is not None}
        label = one.preset if len(given) == 1 else f"{one.preset}-changed"
        while label in seen:
            label += "-again"
        seen.add(label)
        settings = [f"weather.{name}={value}" for name, value in given.items()]
        selected = settings if len(given) > 1 else [f"weather={one.preset}"]
        yield Weather(label=label, settings=tuple(selected), parameters=given)


def _keywords(guard: Guard | None) -> dict[str, Any]:
    """Returns the keyword arguments of a verb for a defense with its calibration data."""
    if guard is None:
        return {}
    return {"defense": guard.defense, "defense_settings": guard.settings, **calibration_arguments(guard)}


def calibration_arguments(guard: Guard) -> dict[str, Any]:
    """Returns the keyword arguments `calibration` and `calibration_patched` of a verb; those of None are left out.

    Args:
        guard: the defense with its calibration data.
    """
    given = {"calibration": guard.calibration, "calibration_patched": guard.calibration_patched}
    return {name: root for name, root in given.items() if root is not None}
