"""Writes the records of a benchmark (`gear bench --record`): one file per network and defense, and the patches."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.contracts.specs import AttackSpec, DefenseSpec
from gear.dataset.files import inside, read_bytes, sha256, write_whole
from gear.dataset.hashing import file_hash
from gear.dataset.json_text import load_json
from gear.dataset.layout import manifest_path
from gear.dataset.reading import Dataset
from gear.leaderboard.package_facts import package_metadata, printable
from gear.leaderboard.reading import encoded
from gear.leaderboard.record import (
    AttackFacts,
    Benchmark,
    Data,
    Entry,
    Figure,
    Kind,
    PatchFacts,
    Record,
    SampleResult,
    canonical,
    digest,
)
from gear.measuring.guard import Guard, open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.metric_json import known_json
from gear.measuring.plugin_selection import Chosen
from gear.measuring.reports import OUTSIDE_PATCH, TASK
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.datasets import open_dataset
from gear.values.errors import FieldError, GearError
from gear.values.serial import Json
from gear.verbs.bench.config import settings_of
from gear.verbs.bench.drives.recording import controller_facts, drive_claims
from gear.verbs.bench.drives.results import DriveSection
from gear.verbs.bench.plan import PATCH, Plan, PlannedEvaluation
from gear.verbs.bench.plugin_facts import plugin_facts, without_folders
from gear.verbs.bench.report import FOUND_SHARE, BenchReport, Metric, Result, TaskResult
from gear.verbs.bench.validation import TaskPlugins
from gear.verbs.evaluate.report import Pool
from gear.verbs.evaluate.table import metric_title

RECORDS = "records"
AUROC = "auroc"


def write_records(report: BenchReport, plan: Plan, name: str, kind: Kind | None = None) -> list[Path]:
    """Writes one record per network and defense into the folder `records` of the benchmark, and the patches as
    `records/patches/<sha256>.png`.

    Args:
        report: results of the benchmark.
        plan: plan of the benchmark.
        name: name of the benchmark's config.
        kind: kind of every record; by default `defense` behind a defense and `model` otherwise.

    Returns:
        Paths of the records.

    Raises:
        GearError: a value cannot be part of a record.
    """
    written = []
    for task, task_plugins in zip(report.tasks, plan.plugins_of_tasks, strict=True):
        if task.metric is None:
            raise GearError(f"{task.name}: has no metric by which networks can be ranked, so there is no record")
        for one, planned in zip(task.results, plan.planned_evaluations(task_plugins), strict=True):
            try:
                record = _with_drives(_record(task, one, planned, plan, name, kind), report.drives, planned, plan)
            except FieldError as error:
                raise GearError(
                    f"{plan.name(planned.model, planned.defense)} of {task.name}: no record: {error}"
                ) from error
            data = encoded(record)
            label = f"{task_plugins.folder}-{plan.name(planned.model, planned.defense)}-seed{record.benchmark.seed}"
            relative = f"{RECORDS}/{label}.json"
            write_whole(report.out, relative, data)
            written.append(report.out / relative)
        _copy_patches(plan, task_plugins, report.out)
    return written


def _record(
    task: TaskResult, one: Result, planned: PlannedEvaluation, plan: Plan, name: str, kind: Kind | None
) -> Record:
    guard = guard_of(plan, planned)
    datasets = [open_dataset(row.dataset) for row in one.evaluation.rows]
    data, samples, metric = _samples(task, one, planned, plan, datasets)
    config = reduced(plan, planned)
    alone = next(other for other in task.results if other.model == one.model and other.defense is None)
    return Record(
        benchmark=Benchmark(name=printable(Path(name).stem), config=config, sha256=digest(config)),
        entry=_entry(task, one, planned, kind, random=is_random(planned, guard, datasets[0], plan.config.seed)),
        attack=_attack(plan),
        environment=_environment(one, datasets[0]),
        data=data,
        calibration=tuple(_calibration(plan, guard)),
        patches=tuple(_patches(plan, planned)),
        results=tuple(_figures(task, one)),
        reference=() if planned.defense is None else tuple(_figures(task, alone)),
        sample_metric=metric,
        samples=samples,
        cost_s={key.removesuffix("_s"): value for key, value in one.pool(PATCH).cost.items()},
    )


def _with_drives(record: Record, section: DriveSection | None, planned: PlannedEvaluation, plan: Plan) -> Record:
    drives = drive_claims(section, planned)
    return replace(record, drives=drives, controller=controller_facts(plan, planned)) if drives else record


def guard_of(plan: Plan, planned: PlannedEvaluation) -> Guard | None:
    """The defense of an evaluation with its calibration data; None for a network alone.

    Args:
        plan: plan of the benchmark.
        planned: the evaluation.
    """
    arguments = plan.evaluation(planned).arguments
    return Guard.of(
        arguments.get("defense"),
        arguments.get("defense_settings", ()),
        arguments.get("calibration"),
        arguments.get("calibration_patched"),
    )


def reduced(plan: Plan, planned: PlannedEvaluation) -> Json:
    """The bench config with only one network and its defense, as JSON without folders of this machine.

    Paths keep only their last part: a town's file becomes its name, a scene of a file the bare name of the scene. A
    check of the record gets the places of these files as arguments.

    Args:
        plan: plan of the benchmark.
        planned: the evaluation whose network and defense are kept.
    """
    config = without_folders(to_plain(plan.config))
    config["tasks"] = {
        task: {
            **bench,
            "models": {planned.model.label: bench["models"][planned.model.label]},
            "defenses": {}
            if planned.defense is None
            else {planned.defense.label: bench["defenses"][planned.defense.label]},
        }
        for task, bench in config["tasks"].items()
        if task == planned.task_plugins.name
    }
    config["places"] = {
        Path(town).stem: [text.rpartition(":")[2] for text in scenes] for town, scenes in config["places"].items()
    }
    if config["calibration"] is not None:
        town, scene = config["calibration"]["town"], config["calibration"]["scene"]
        config["calibration"] = {"town": Path(town).stem, "scene": scene.rpartition(":")[2]}
    config["transfer"] = False
    return config


def _entry(task: TaskResult, one: Result, planned: PlannedEvaluation, kind: Kind | None, *, random: bool) -> Entry:
    assert task.metric is not None
    spec = None if planned.defense is None else planned.defense.chosen.found.spec
    assert spec is None or isinstance(spec, DefenseSpec)
    network = plugin_facts(planned.model.chosen, one.evaluation.facts["model"]["weights_sha256"])
    defense = None if planned.defense is None else plugin_facts(planned.defense.chosen)
    trained = one.evaluation.facts["model"].get("trained_on", "")
    return Entry(
        kind=kind or ("model" if defense is None else "defense"),
        task=task.name,
        metric=task.metric.title,
        lower_is_better=task.metric.lower_is_better,
        network=network,
        defense=defense,
        gradient=None if spec is None else spec.gradient,
        is_random=random,
        trained_on=printable(trained if isinstance(trained, str) else ""),
        **package_metadata((defense or network).package),
    )


def is_random(planned: PlannedEvaluation, guard: Guard | None, dataset: Dataset[Any], seed: int) -> bool:
    """Whether a defense gives another result for the first sample of a dataset if its random generator has another
    state.

    Args:
        planned: the evaluation.
        guard: the defense with its calibration data; None for the network alone, which is not random.
        dataset: dataset whose first sample is used.
        seed: seed of the defense.
    """
    if guard is None:
        return False
    opened = open_guard(guard, [planned.model.chosen], planned.task_plugins.name)
    guarded = GuardedModel(planned.model.chosen, opened, seed=seed)
    return guarded.is_random(dataset[0].images)


def _attack(plan: Plan) -> AttackFacts:
    config = plan.config.attack
    found, options = find("attack", config.plugin), with_overrides(NO_OPTIONS, settings_of(config.set))
    assert isinstance(found.spec, AttackSpec)
    return AttackFacts(
        plugin=plugin_facts(Chosen(found=found, options=options)),
        knowledge="white-box" if found.spec.needs_gradients else "black-box",
        steps=0 if config.queries else config.steps,
        queries=config.queries,
    )


def _environment(one: Result, dataset: Dataset[Any]) -> dict[str, str]:
    renderer = dataset.content(dict, "renderer")
    facts = {
        **{f"renderer.{key}": value for key, value in renderer.items()},
        **dataset.content(dict, "versions"),
        **one.evaluation.facts["versions"],
    }
    return {key: printable(str(value)) for key, value in facts.items()}


def _data(dataset: Dataset[Any], scene: str, weather: str, patch: str) -> Data:
    return Data(
        scene=scene,
        weather=weather,
        patch=patch,
        samples=len(dataset),
        content_key=dataset.plan.content_key,
        twin_key=dataset.plan.twin_key,
        manifest_sha256=file_hash(inside(dataset.root, manifest_path(dataset.plan.info.split))),
    )


def _samples(
    task: TaskResult, one: Result, planned: PlannedEvaluation, plan: Plan, datasets: list[Dataset[Any]]
) -> tuple[tuple[Data, ...], tuple[SampleResult, ...], str]:
    """The datasets, the results of all their samples, and the name of the metric of single samples."""
    places = [(kind, *place) for kind in planned.pools for place in plan.places()]
    metric = sample_metric(task.metric, one.evaluation.rows[0].per_sample[0]["metrics"])
    data, samples = [], []
    for number, ((kind, scene, weather), row, dataset) in enumerate(
        zip(places, one.evaluation.rows, datasets, strict=True)
    ):
        data.append(_data(dataset, scene.label, weather.label, kind))
        for note in row.per_sample:
            value = note["metrics"].get(TASK, {}).get(metric)
            samples.append(
                SampleResult(
                    data=number,
                    index=note["index"],
                    sha256=files_sha256(note["sha256"]),
                    value=value,
                    score=note["score"],
                )
            )
    return tuple(data), tuple(samples), metric


def files_sha256(hashes: Json) -> str:
    """One SHA-256 for the files of a prediction, from their hashes by name."""
    return sha256(canonical(dict(hashes)))


def sample_metric(ranked: Metric | None, metrics: Json) -> str:
    """The name of the metric of single samples that records hold; empty if the task has none.

    Args:
        ranked: the task's ranked metric; None if it has none.
        metrics: metrics of one sample by report and name.
    """
    named = metrics.get(TASK, {})
    wanted = ("" if ranked is None else ranked.name, FOUND_SHARE, *named)
    return next((name for name in wanted if name in named), "")


def _calibration(plan: Plan, guard: Guard | None) -> Iterator[Data]:
    if guard is None or plan.calibration is None:
        return
    for root, patch in ((guard.calibration, "none"), (guard.calibration_patched, PATCH)):
        if root is not None:
            yield _data(open_dataset(root), plan.calibration.label, plan.weathers[0].label, patch)


def _patches(plan: Plan, planned: PlannedEvaluation) -> Iterator[PatchFacts]:
    """Yields the patches that the entry sees, and those on which its defense is calibrated."""
    task_plugins = planned.task_plugins
    targets = [planned.model.label]
    if planned.defense is not None and planned.defense in plan.adaptive_defenses(task_plugins):
        targets.append(plan.name(planned.model, planned.defense))
    if planned.defense is None and plan.config.transfer:
        targets += [one.label for one in task_plugins.models if one is not planned.model]
    needs_calibration = (
        planned.defense is not None and planned.defense.needs_calibration and plan.calibration is not None
    )
    for target in targets:
        is_learnt = needs_calibration and target == planned.model.label
        for scene in (*plan.scenes, *([plan.calibration] if is_learnt and plan.calibration else [])):
            folder = plan.patch(task_plugins, scene, target)
            facts: Any = load_json(folder / "attack.json")
            achieved = (facts.get("achieved") or {}).get("validation") or {}
            gain = (
                None
                if None in (achieved.get("patch"), achieved.get("random"))
                else (achieved["patch"] - achieved["random"])
            )
            masking = facts.get("masking")
            kept = masking["kept"] / masking["promised"] if masking and masking["promised"] else None
            yield PatchFacts(
                scene=scene.label,
                target=target,
                sha256=tuple(sha256(read_bytes(path)) for path in _pictures(folder)),
                **known_json({} if gain is None else {"gain": gain}),
                **known_json({} if kept is None else {"gradient_kept": kept}),
            )


def _pictures(folder: Path) -> list[Path]:
    """The pictures of a patch folder in the order of the surfaces."""
    found = {
        int(match[1]): path for path in folder.iterdir() if (match := re.fullmatch(r"patch_(\d+)\.png", path.name))
    }
    return [found[number] for number in sorted(found)]


def _copy_patches(plan: Plan, task_plugins: TaskPlugins, root: Path) -> None:
    """Copies all patches of a task beside the records; each file's name is its hash."""
    scenes = (*plan.scenes, *([] if plan.calibration is None else [plan.calibration]))
    for model in task_plugins.models:
        for defense in plan.adaptive_defenses(task_plugins):
            for scene in scenes:
                folder = plan.patch(task_plugins, scene, plan.name(model, defense))
                for path in _pictures(folder) if folder.is_dir() else []:
                    data = read_bytes(path)
                    write_whole(root, f"{RECORDS}/patches/{sha256(data)}.png", data)


def _figures(task: TaskResult, one: Result) -> Iterator[Figure]:
    """Yields the ranked metric, the metric without the patch's pixels, AUROC and the mask's IoU for each pool."""
    assert task.metric is not None
    for pool in one.evaluation.pools:
        value = task.value(pool)
        if value is not None:
            yield _figure(pool, task.metric.title, value.as_json())
        outside = pool.metrics.get(OUTSIDE_PATCH, {}).get(task.metric.name)
        if outside is not None:
            yield _figure(pool, metric_title(OUTSIDE_PATCH, task.metric.name), outside.as_json())
        against = one.against(pool)
        if against is not None and against.auroc is not None:
            yield _figure(pool, AUROC, against.auroc.as_json())
        for name, mean in known_json(pool.defense).items():
            yield _figure(pool, name, {"value": mean, "low": None, "high": None})


def _figure(pool: Pool, name: str, value: Json) -> Figure:
    return Figure(patch=pool.name, name=name, n=pool.samples, **value)
