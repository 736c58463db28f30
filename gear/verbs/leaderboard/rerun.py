"""Measures samples of a record again: data from the record's config, patches from their files, installed plugins."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from gear.collecting.job import resolve
from gear.collecting.run import run_job
from gear.contracts.tasks import NO_PATCH
from gear.dataset.files import sha256, write_whole
from gear.dataset.plan import read_plan
from gear.dataset.reading import Dataset
from gear.dataset.sharding.shards import Picked, Shard
from gear.leaderboard.reading import limited
from gear.leaderboard.record import Data, PatchFacts, Plugin, Record
from gear.measuring.guard import UNGUARDED, open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.reports import TASK
from gear.measuring.scoring import Scorer
from gear.measuring.statistics import AnyEvaluator
from gear.plugins.datasets import open_dataset, task_of
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.progress import NO_CALLBACKS, Callbacks
from gear.verbs.bench.drives.recording import controller_facts
from gear.verbs.bench.plan import RANDOM, SPLITS, Plan, PlannedEvaluation, Step
from gear.verbs.bench.plugin_facts import plugin_facts
from gear.verbs.bench.recording import files_sha256, guard_of, sample_metric
from gear.verbs.bench.report import Metric
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import prepared
from gear.verbs.collect.request import CollectRequest

MOST_PATCH_BYTES = 8 << 20
MOST_SIDE_PX = 8192


@dataclass(frozen=True, slots=True, kw_only=True)
class Again:
    """One sample that was measured again.

    Attributes:
        patch: kind of patch, such as `none`, `random`, `patch` or `adaptive patch`.
        place: number of the (scene, weather) pair in the benchmark.
        index: index of the sample.
        content_key: hash of everything that decides the pictures of the dataset that was made again.
        sha256: hash over the files of the prediction.
        value: metric of the sample; None if it is undefined.
        score: the defense's score; None without a score.
        part: evaluator of the ranked metric that holds this sample alone; None if the task has no ranked metric.
    """

    patch: str
    place: int
    index: int
    content_key: str
    sha256: str
    value: float | None
    score: float | None
    part: AnyEvaluator | None = None


class Rerun:
    """The benchmark of a record on this machine.

    Attributes:
        record: the record.
        plan: plan of the benchmark, whose folders lie in a work folder.
        planned: the recorded network, with its defense if it has one.
        network, defense: facts about the installed plugins; `defense` is None without a defense.
        pictures: (H, W, 3) uint8 pictures by camera name of the sample that was measured last.
        renderer: name, driver and device of the renderer that made them.
        metric: the task's ranked metric; None if it has none.
        sample_metrics: names of the metric of single samples, as the installed task states them.
    """

    def __init__(
        self,
        record: Record,
        work: Path,
        patches: Path,
        settings: Sequence[str] = (),
        device: str | None = None,
        callbacks: Callbacks = NO_CALLBACKS,
    ) -> None:
        """Looks up the plugins and copies the patches; nothing is rendered.

        Args:
            record: the record.
            work: folder for datasets.
            patches: folder with the patches, `<sha256>.png`.
            settings: `KEY=VALUE` texts that replace keys of the record's config, such as the path of a town's file.
            device: device of the networks; None for that of the config.
            callbacks: callbacks that receive the progress of calibrations.

        Raises:
            GearError: a plugin is not installed, the config does not fit, or it names several tasks, networks or
                defenses.
        """
        self.record, self._work, self._patches = record, work, patches
        self._callbacks = callbacks
        refuse_enormous(record.benchmark.config)
        write_whole(work, "bench.yml", yaml.safe_dump(record.benchmark.config, sort_keys=False).encode())
        asked = tuple(settings)
        self.plan = _plan(work / "bench.yml", work / "bench", asked, device)
        self._asked, self._device = asked, device
        self.planned = only_evaluation(self.plan, guarded=record.entry.defense is not None)
        spec = self.planned.task_plugins.task
        self.metric = Metric.of(spec.metric, lower_is_better=spec.lower_is_better) if spec.metric else None
        self.sample_metrics: set[str] = set()
        self._make: Callable[[], AnyEvaluator] | None = None
        self.network = plugin_facts(self.planned.model.chosen)
        self.defense = None if self.planned.defense is None else plugin_facts(self.planned.defense.chosen)
        self.pictures: Mapping[str, UInt8Image] = {}
        self.renderer: Mapping[str, Any] = {}
        self._guarded: dict[bool, GuardedModel] = {}

    def installed(self) -> list[tuple[str, Plugin, Plugin]]:
        """The network, the defense and the controller as (role, plugin in the record, installed plugin)."""
        found = [("network", self.record.entry.network, self.network)]
        if self.defense is not None and self.record.entry.defense is not None:
            found.append(("defense", self.record.entry.defense, self.defense))
        controller = controller_facts(self.plan, self.planned)
        if self.record.controller is not None and controller is not None:
            found.append(("controller", self.record.controller, controller))
        return found

    def data_of(self, patch: str) -> list[Data]:
        """The datasets of the record with a kind of patch, in the order of the benchmark's places."""
        return [one for one in self.record.data if one.patch == patch]

    def guarded(self, *, with_defense: bool = True) -> GuardedModel:
        """The network behind its defense, or alone; the defense is calibrated on data that are made again.

        Args:
            with_defense: whether the record's defense is used; otherwise the network is returned alone.

        Returns:
            The model; it is built once and used again.

        Raises:
            GearError: a patch of the calibration is missing, or a plugin fails.
        """
        if with_defense not in self._guarded:
            chosen, opened = self.planned.model.chosen, UNGUARDED
            guard = guard_of(self.plan, self.planned) if with_defense else None
            if guard is not None:
                if guard.calibration is not None:
                    self._calibration()
                opened = open_guard(guard, [chosen], self.planned.task_plugins.name, callbacks=self._callbacks)
            self._guarded[with_defense] = GuardedModel(chosen, opened, seed=self.plan.config.seed)
        return self._guarded[with_defense]

    def ranked(self, again: Sequence[Again]) -> float | None:
        """The ranked metric over some samples together; None if it is undefined."""
        if self.metric is None or self._make is None:
            return None
        whole = self._make()
        for one in again:
            if one.part is not None:
                whole.merge(one.part)
        value = whole.result().get(self.metric.name)
        return value if value is not None and math.isfinite(value) else None

    def pictures_of_calibration(self) -> int:
        """The number of pictures on which the defense is calibrated."""
        guard = guard_of(self.plan, self.planned)
        both = (None, None) if guard is None else (guard.calibration, guard.calibration_patched)
        return self.plan.config.samples.calibrate * sum(one is not None for one in both)

    def again(self, patch: str, place: int, indices: Sequence[int], *, with_defense: bool = True) -> list[Again]:
        """Makes samples of one dataset of the benchmark again and measures them.

        Args:
            patch: kind of patch, such as `none` or `adaptive patch`.
            place: number of the (scene, weather) pair in the benchmark.
            indices: indices of the samples.

        Returns:
            One entry per sample, in the order of `indices`.

        Raises:
            GearError: a sample cannot be made, or a plugin fails.
        """
        step = self._step(self.planned.pools[patch][place])
        dataset = self._part(step, self.data_of(patch)[place].samples, indices)
        return self._measured(dataset, patch, place, indices, self.guarded(with_defense=with_defense))

    def fresh(self, patch: str, place: int, count: int, seed: int, *, with_defense: bool = True) -> list[Again]:
        """Makes samples with another seed, which are not part of the benchmark, and measures them.

        Args:
            patch: kind of patch, such as `none` or `adaptive patch`.
            place: number of the (scene, weather) pair in the benchmark.
            count: number of samples.
            seed: seed of the samples.
            with_defense: whether the record's defense is used.

        Raises:
            GearError: a sample cannot be made, or a plugin fails.
        """
        root = self.planned.pools[patch][place]
        step = self._step(root)
        out = self._work / "fresh" / root.relative_to(self._work)
        arguments = {**step.arguments, "seed": seed, "samples": count, "out": str(out)}
        self._collect(replace(step, arguments=arguments))
        dataset = open_dataset(out)
        return self._measured(dataset, patch, place, range(count), self.guarded(with_defense=with_defense))

    def elsewhere(self, settings: Sequence[str]) -> Rerun:
        """The same benchmark in other places, with the patches of the benchmark's first scene.

        Args:
            settings: `KEY=VALUE` settings of the bench config that name the other places.

        Raises:
            GearError: a place does not exist, or has more surfaces than the first scene, or no patches are named.
        """
        asked = (*self._asked, *settings)
        other = Rerun(self.record, self._work / "withheld", self._patches, asked, self._device, self._callbacks)
        moved = moved_patches(self.record, self.planned.model.label, [scene.label for scene in other.plan.scenes])
        other.record = replace(self.record, patches=(*moved, *self.record.patches))
        return other

    def _calibration(self) -> None:
        """Makes the datasets on which the defense is calibrated again."""
        for step in self.plan.steps():
            if step.verb == "collect" and step.arguments["split"] == SPLITS["calibrate"]:
                self._collect(step)

    def _step(self, root: Path) -> Step:
        """The step that collects the pictures of a folder.

        Raises:
            GearError: the benchmark has no such pictures.
        """
        steps = (step for step in self.plan.steps() if step.verb == "collect")
        found = next((step for step in steps if step.arguments["out"] == str(root)), None)
        if found is None:
            raise GearError(f"{root.name}: the record's config makes no such pictures")
        return found

    def _collect(self, step: Step, part: Shard | None = None) -> None:
        arguments = dict(step.arguments)
        if arguments["patch"] not in (NO_PATCH, RANDOM):
            self.place_patches(Path(arguments["patch"]))
        run_job(resolve(CollectRequest(**arguments).loaded()), shard=part)

    def _part(self, step: Step, samples: int, indices: Sequence[int]) -> Dataset[Any]:
        """A dataset of which only some samples exist."""
        self._collect(step, Picked(sequences=frozenset(indices)))
        root, split = Path(step.arguments["out"]), step.arguments["split"]
        plan = read_plan(root, split)
        assert plan is not None
        if plan.frames_per_sequence > 1:
            raise GearError(f"{self.record.benchmark.name}: driving sequences cannot be checked")
        return Dataset(root=root, plan=plan, task=task_of(root, plan), manifest={"samples": [{}] * samples})

    def _measured(
        self, dataset: Dataset[Any], patch: str, place: int, indices: Sequence[int], guarded: GuardedModel
    ) -> list[Again]:
        more = () if self.metric is None or self.metric.report == TASK else (self.metric.report,)
        scorer = Scorer(dataset, self._work, "scores", more, guarded.plugin)
        if self.metric is not None:
            self._make = scorer.reports[self.metric.report].make
        found = []
        self.renderer = dataset.content(dict, "renderer")
        for index in indices:
            sample = dataset[index]
            self.pictures = sample.images
            (answer,) = guarded.predict([sample.images], [index])
            result = scorer.score(index, sample, answer).result
            self.sample_metrics.add(sample_metric(self.metric, result.metrics))
            value = result.metrics.get(TASK, {}).get(self.record.sample_metric)
            found.append(
                Again(
                    patch=patch,
                    place=place,
                    index=index,
                    content_key=dataset.plan.content_key,
                    sha256=files_sha256(result.sha256),
                    value=None if value is None or value != value else value,
                    score=result.score,
                    part=None if self.metric is None else result.parts[self.metric.report],
                )
            )
        return found

    def place_patches(self, folder: Path) -> None:
        """Copies the patches of one scene into the folder where the benchmark expects them.

        The names of the files are hashes, which are compared with the content.

        Args:
            folder: folder of the patches of one scene in the plan of the benchmark.

        Raises:
            GearError: the record names no patches for this folder, or a file is missing or has another content.
        """
        scene, target = folder.name, folder.parent.name
        facts = next((one for one in self.record.patches if (one.scene, one.target) == (scene, target)), None)
        if facts is None:
            raise GearError(f"the record names no patches of {target} in {scene}")
        for number, digest in enumerate(facts.sha256):
            data = limited(self._patches / f"{digest}.png", MOST_PATCH_BYTES)
            if sha256(data) != digest:
                raise GearError(f"{self._patches / digest}.png: is not the patch of that hash")
            write_whole(folder, f"patch_{number}.png", data)


def check_data(record: Record, *, places: int, samples: int) -> None:
    """Checks that a record has as many datasets and samples as its config makes.

    Args:
        record: the record.
        places: number of (scene, weather) pairs of the config.
        samples: number of samples of each dataset in the config.

    Raises:
        GearError: a kind of patch has another number of datasets, or a dataset has another number of samples.
    """
    for kind in record.kinds():
        found = [one.samples for one in record.data if one.patch == kind]
        if found != [samples] * places:
            made = f"{places} datasets of {samples} samples"
            raise GearError(f"the record's config makes {made} with {kind}, the record has {_numbers(found)}")


def _numbers(samples: Sequence[int]) -> str:
    shown = ", ".join(map(str, samples[:4]))
    return f"{len(samples)} of {shown}{' and more' if len(samples) > 4 else ''} samples"


def moved_patches(record: Record, target: str, scenes: Sequence[str]) -> list[PatchFacts]:
    """The patches that a record names for its first scene, once for each other scene, to be shown there.

    Args:
        record: the record.
        target: name of the attacked network.
        scenes: names of the other scenes.

    Raises:
        GearError: the record names no patches of this network.
    """
    first = next((one.scene for one in record.patches if one.target == target), None)
    if first is None:
        raise GearError(f"the record names no patches of {target} that other places could show")
    return [replace(one, scene=scene) for scene in scenes for one in record.patches if one.scene == first]


def only_evaluation(plan: Plan, *, guarded: bool) -> PlannedEvaluation:
    """The single evaluation of a record's config.

    Args:
        plan: plan of the config.
        guarded: whether the network is behind a defense.

    Raises:
        GearError: the config has several tasks, or not exactly one network with or without a defense.
    """
    if len(plan.plugins_of_tasks) != 1:
        raise GearError(f"the record's config has {len(plan.plugins_of_tasks)} tasks; a record is about one")
    every = plan.planned_evaluations(plan.plugins_of_tasks[0])
    found = [one for one in every if (one.defense is not None) == guarded]
    if len(found) != 1:
        what = "network behind a defense" if guarded else "network"
        raise GearError(f"the record's config names {len(found)} times a {what}; a record is about one")
    return found[0]


def _plan(config: Path, out: Path, settings: Sequence[str], device: str | None) -> Plan:
    return prepared(BenchRequest(config=config, out=out, settings=tuple(settings), device=device))


def refuse_enormous(config: Mapping[str, Any]) -> None:
    """Refuses a config with pictures that no machine can render.

    Raises:
        GearError: a side of the pictures is larger than `MOST_SIDE_PX`.
    """
    for key, value in config.items():
        if isinstance(value, dict):
            refuse_enormous(value)
        elif key.endswith("_px"):
            try:
                is_small = float(value) <= MOST_SIDE_PX
            except (TypeError, ValueError):
                is_small = True  # the config's reader says what is wrong with it
            if not is_small:
                raise GearError(f"{key} is {str(value)[:20]}; at most {MOST_SIDE_PX} are checked")
