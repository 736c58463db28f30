"""`gear.evaluate`: runs a model over datasets, computes metrics, compares twins (datasets that differ only in
their patch) and writes the results.
"""

from __future__ import annotations

import importlib.metadata
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from gear.config.dump import to_plain
from gear.dataset.executors.engines import DEFAULT
from gear.dataset.files import clear_scratch, inside, write_whole
from gear.dataset.json_text import dump_json, load_json
from gear.dataset.locks import exclusive_lock
from gear.dataset.plan import differences
from gear.dataset.reading import Dataset
from gear.dataset.store import check_output
from gear.measuring.guard import Guard, open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.notes import grouped
from gear.measuring.open_datasets import opened, row_names
from gear.measuring.plugin_selection import chosen_model
from gear.measuring.shown_size import size_note
from gear.reporting.display import displayed
from gear.values.errors import DatasetError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.values.serial import Json
from gear.verbs.evaluate.alarm_notes import alarm_notes
from gear.verbs.evaluate.compare import (
    EvaluatedDataset,
    compared,
    drive_note,
    labelled,
    row_report,
    together,
    twin_pairs,
)
from gear.verbs.evaluate.distribute import FIT, measure_dataset, predict_in_workers, store_fit
from gear.verbs.evaluate.page import PAGE, page
from gear.verbs.evaluate.pictures import write_sheets
from gear.verbs.evaluate.pools import Pools, check_pools, pooled
from gear.verbs.evaluate.report import EvaluateReport
from gear.verbs.evaluate.request import EvaluateRequest
from gear.verbs.evaluate.table import table

T = TypeVar("T")

INTERVALS = "95 %: jackknife over streets, Student's t corrected for skewness; exact where a share is 0 or 1"
"""The note in results.json on how the intervals are computed."""

LEARNT = {"calibration", "calibration_samples"}
"""Keys of `plan.json`, the inputs of an evaluation, that describe the calibration data of the defense."""


class CalibrationChangedError(DatasetError):
    """Raised if the folder contains an evaluation that differs from the requested one only in the calibration data
    of its defense.
    """


def evaluate(
    data: str | Path | Sequence[str | Path],
    *,
    model: str,
    model_settings: Iterable[str] = (),
    defense: str | None = None,
    defense_settings: Iterable[str] = (),
    split: str | None = None,
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    reports: Sequence[str] = (),
    out: str | Path | None = None,
    batch: int | None = None,
    workers: int = 2,
    engine: str = DEFAULT,
    address: str | None = None,
    engine_workers: int = 1,
    seed: int = 0,
    pictures: int = 4,
    pools: Pools | None = None,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> EvaluateReport:
    """Evaluates a model, with or without a defense, on datasets of its task; resumes an interrupted run.

    The folder `out` gets results.json, table.txt, report.html with pictures, and one folder per dataset with
    predictions in the result layout of the dataset's format and a result file (scores) per sample. Samples with a
    result file are not predicted again, unless their files are damaged. Datasets that differ only in their patch are
    compared sample by sample, and detections object by object. Intervals are 95 % jackknife intervals over streets,
    groups of samples with the same scene content.

    Args:
        data: roots of datasets, or folders of such roots, all of one task; `DIR:SPLIT` selects a split.
        model: name of a model plugin.
        model_settings: `KEY=VALUE` texts for the model's options.
        defense: name of a defense plugin.
        defense_settings: `KEY=VALUE` texts for the defense's options.
        split: split of the datasets; optional if each has only one.
        calibration: dataset without patches on which the defense is calibrated.
        calibration_patched: the calibration dataset rendered with patches.
        reports: names of further groups of metrics: a report of the task (`reference`); `outside_patch`, which excludes
            the patch and 5 px around it; or a metric plugin, as `NAME` or `NAME:KEY=VALUE,KEY=VALUE`.
        out: folder of the results; `evaluations/<task>/<model>[+<defense>]` by default.
        batch: samples per batch; by default one, or up to four small pictures for gear's own models.
        workers: number of threads that read samples, and of threads that compute metrics and write files.
        engine: name of the engine whose workers evaluate whole datasets; `processes` uses processes on this machine.
        address: address of the engine's cluster: a Ray cluster, or a partition of SLURM.
        engine_workers: number of datasets that are evaluated at the same time. With more than one, a script needs
            `if __name__ == "__main__":`.
        seed: seed of the defense's random draws and of the permutation tests.
        pictures: number of samples on the sheet of pictures of each dataset, of which those come first in which the
            patch changed most; 0 for no sheets.
        pools: roots of datasets that are evaluated as one, by name of the pool. Pools with the same scenes as the pools
            `none` and `random` are compared with these, sample by sample.
        progress: shows a progress bar.
        on_progress: called after every sample; with an engine, first after every dataset.
        on_fit_progress: called after every calibration sample that the defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called with one line per damaged prediction that is made again, and per problem of the defense's
            calibration.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = EvaluateRequest(
        data=(data,) if isinstance(data, (str, Path)) else tuple(data),
        model=model,
        model_settings=tuple(model_settings),
        guard=Guard.of(defense, defense_settings, calibration, calibration_patched),
        split=split,
        reports=tuple(reports),
        out=out,
        batch=batch,
        workers=workers,
        engine=engine,
        address=address,
        engine_workers=engine_workers,
        seed=seed,
        pictures=pictures,
        pools=pools or {},
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "evaluate", progress=progress) as shown:
        return run_evaluate(request, shown)


def run_evaluate(request: EvaluateRequest, callbacks: Callbacks) -> EvaluateReport:
    """Runs an evaluation with the arguments in `request`, which `gear.evaluate` describes. Results and pages are
    written into the folder of the evaluation; stored results of an earlier run are used again.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    chosen = chosen_model(request.model, request.model_settings)
    datasets = opened(request.data, request.split, chosen, request.reports)
    check_pools(request.pools, [one.root for one in datasets])
    task, names = datasets[0].plan.task["name"], row_names(datasets)
    guard = open_guard(request.guard, [chosen], task, callbacks=callbacks)
    root, learnt = request.folder(task), guard.calibration
    check_output(root, "write the evaluation into a folder of its own")
    guarded = GuardedModel(chosen, guard, seed=request.seed)
    facts = {
        "task": datasets[0].plan.task,
        "model": chosen.facts() | {"weights_sha256": guarded.weights_sha256},
        "defense": None if guard.defense is None else guard.defense.facts(),
        "calibration": learnt.facts(),
        **learnt.counted(),
        "seed": request.seed,
    }
    with exclusive_lock(root, callbacks.on_warning):
        _begin(root, facts)
        rows = _measured(request, datasets, names, guarded, callbacks)
        done = _counter(callbacks.part("computing metrics and intervals"), _results(request, rows))
        learnt_facts = _fit_facts(root, guarded, request, callbacks.on_warning)
        sheets = write_sheets(root, rows, request.pictures, callbacks.on_warning, done)
        made = _counted(map(row_report, rows), done)
        reports = tuple(replace(one, pictures=sheets.get(one.name)) for one in made)
        alarms = alarm_notes(reports, learnt_facts)
        for line in alarms:
            callbacks.on_warning(line)
        said = [note for one in datasets for note in (size_note(chosen, one), drive_note(one), learnt.note(one))]
        more = {
            "reports": list(request.reports),
            "metric_plugins": {
                name: one.facts() for name, one in rows[0].scorer.reports.items() if one.plugin is not None
            },
            "intervals": INTERVALS,
            "timing": {"parallel_batches": guarded.lanes},
            **({} if learnt_facts is None else {"fit": learnt_facts}),
            "versions": _versions(guarded),
            "notes": [*_problems(learnt_facts), *alarms, *grouped([*learnt.doubts(), *said])],
        }
        found = EvaluateReport(
            out=root,
            facts=facts | more,
            rows=reports,
            together=_counted(together(rows), done),
            differences=_counted(compared(rows, request.seed), done),
            pools=_counted(pooled(rows, request.pools, request.seed), done),
        )
        _end(root, found)
    return found


def _fit_facts(root: Path, guarded: GuardedModel, request: EvaluateRequest, on_warning: Warn) -> Json:
    """Returns the report of the defense on its calibration; it is stored for later runs that need no calibration.

    Every problem in the report is passed on as a warning.
    """
    store_fit(root, guarded)
    path = inside(root, FIT)
    if request.guard is None or not path.exists():
        return None
    facts: Json = load_json(path)
    for problem in _problems(facts):
        on_warning(problem)
    return facts


def _problems(facts: Json) -> list[str]:
    return [f"WARNING: {problem}" for problem in (facts or {}).get("problems", [])]


def _measured(
    request: EvaluateRequest,
    datasets: Sequence[Dataset[Any]],
    names: Sequence[str],
    guarded: GuardedModel,
    callbacks: Callbacks,
) -> list[EvaluatedDataset]:
    """Runs the model over the datasets, and returns their samples' scores.

    If an engine is requested, its workers predict the samples; the scores are then read from the stored results.
    """
    predicted = predict_in_workers(request, datasets, guarded, callbacks) if request.is_distributed else None
    done = _counter(callbacks.on_progress, sum(len(one) for one in datasets))
    rows = []
    for position, (dataset, name) in enumerate(zip(datasets, names, strict=True)):
        row = measure_dataset(request, dataset, name, guarded, done)
        if predicted is not None:
            work = predicted[position]
            row = replace(row, made=row.made + work.made, damaged=(*work.damaged, *row.damaged))
        for problem in row.damaged:
            callbacks.on_warning(f"{problem}; the sample was predicted again")
        rows.append(row)
    return rows


def _begin(root: Path, facts: Json) -> None:
    """Writes `plan.json`, all inputs of the evaluation, or checks that an existing plan is equal."""
    clear_scratch(root)
    path = inside(root, "plan.json")
    plain = to_plain(facts)
    try:
        there = load_json(path) if path.exists() else None
    except DatasetError as error:
        problem = f"{error.problem.partition(';')[0]}; use another --out, or delete this folder"
        raise DatasetError(path, problem) from error
    is_ours = isinstance(there, dict) and there.keys() == plain.keys()
    is_empty = next(root.glob("*/samples/*.json"), None) is None
    if there is None or (is_ours and is_empty):
        write_whole(root, "plan.json", dump_json(plain))
    elif there != plain:
        what = ", ".join(differences(there, plain)[:3]) or "its plan.json has other keys"
        is_same_otherwise = is_ours and {key for key in plain if there[key] != plain[key]} <= LEARNT
        raise (CalibrationChangedError if is_same_otherwise else DatasetError)(
            root, f"holds an evaluation of something else ({what}); use another --out"
        )


def _end(root: Path, found: EvaluateReport) -> None:
    """Writes the results and deletes leftovers."""
    write_whole(root, "results.json", dump_json(found.as_json()))
    write_whole(root, "table.txt", table(found).encode())
    write_whole(root, PAGE, page(found).encode())
    clear_scratch(root)


def _counter(on_progress: Progress, total: int) -> Callable[[], None]:
    """Returns a function that counts finished samples and reports the count to `on_progress`; 0 is reported at once."""
    finished = 0

    def done() -> None:
        nonlocal finished
        finished += 1
        on_progress(finished, total)

    on_progress(0, total)
    return done


def _results(request: EvaluateRequest, rows: Sequence[EvaluatedDataset]) -> int:
    """The number of results that are computed after all samples are measured: sheets, rows, combinations, comparisons
    and pools.
    """
    sheets = len(rows) if request.pictures else 0
    return sheets + len(rows) + len(labelled(rows)) + len(twin_pairs(rows)) + len(request.pools)


def _counted(results: Iterable[T], done: Callable[[], None]) -> tuple[T, ...]:
    """Computes results one after another; `done` is called after each."""
    computed = []
    for one in results:
        computed.append(one)
        done()
    return tuple(computed)


def _versions(guarded: GuardedModel) -> Json:
    packages = {"mujoco-gear": "gear", "numpy": "numpy"}
    versions = {name: importlib.metadata.version(package) for package, name in packages.items()}
    if "torch" in sys.modules:
        versions["torch"] = str(sys.modules["torch"].__version__)
    return versions | {"python": platform.python_version(), "device": str(getattr(guarded.model, "device", "cpu"))}
