"""Distributes the datasets of an evaluation over the workers of an engine: processes, Ray or SLURM.

The workers write the predictions and results of all samples. The process of the command then computes the metrics from
these results, as it does after an interrupted run.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from gear.contracts.executors import Needs, Outcome, Report
from gear.dataset.executors.calibrations import CalibrationReports
from gear.dataset.executors.engines import open_engine
from gear.dataset.executors.jobs import JobNotes, carry_out_jobs, run_jobs, shared_folder
from gear.dataset.files import write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.reading import Dataset
from gear.measuring.dataset_run import SampleDone, evaluate_row
from gear.measuring.guard import open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.metric_json import known_json
from gear.measuring.open_datasets import opened, row_names
from gear.measuring.plugin_selection import chosen_model
from gear.measuring.scoring import Scorer
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.values.serial import Json
from gear.verbs.evaluate.compare import EvaluatedDataset, streets_of
from gear.verbs.evaluate.request import EvaluateRequest

FIT = "fit.json"
"""Name of the file with the report of a defense on its calibration."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """What a worker did with one dataset.

    Attributes:
        made: number of samples that it predicted.
        damaged: one line per stored prediction that could not be read and was made again.
    """

    made: int = 0
    damaged: tuple[str, ...] = ()


def measure_dataset(
    request: EvaluateRequest, dataset: Dataset[Any], name: str, guarded: GuardedModel, done: SampleDone
) -> EvaluatedDataset:
    """Runs the model over one dataset, stores the results of its samples, and returns them; stored results of an
    earlier run are read.

    Args:
        request: the arguments of `gear.evaluate`.
        dataset: the opened split.
        name: name of the dataset's row, which is also the name of its folder of results.
        guarded: the model with its defense.
        done: called without arguments after each sample, when its files are written.
    """
    scorer = Scorer(dataset, request.folder(dataset.plan.task["name"]), name, request.reports, guarded.plugin)
    batch = request.batch or guarded.usual_batch(dataset)
    row = evaluate_row(dataset, scorer, guarded, batch=batch, workers=request.workers, done=done)
    scorer.finish(row.results)
    return EvaluatedDataset(
        name=name,
        dataset=dataset,
        scorer=scorer,
        results=row.results,
        streets=streets_of(dataset),
        made=row.made,
        damaged=tuple(str(problem) for problem in row.damaged),
    )


def store_fit(root: Path, guarded: GuardedModel) -> None:
    """Writes the report of the defense on its calibration, for later runs in which the defense is not calibrated again;
    does nothing without such a report.

    Args:
        root: folder of the evaluation.
        guarded: the model with its defense.
    """
    report = guarded.fit_report()
    if report is not None:
        facts: Json = {"values": known_json(report.values), "problems": list(report.problems)}
        write_whole(root, FIT, dump_json(facts))


def predict_in_workers(
    request: EvaluateRequest, datasets: Sequence[Dataset[Any]], guarded: GuardedModel, callbacks: Callbacks
) -> list[Predicted]:
    """Lets the workers of the requested engine predict all samples; each worker predicts one dataset after another.

    Args:
        request: the evaluation, whose folder has its `plan.json`.
        datasets: all datasets of the evaluation.
        guarded: the model, from which the workers' device is known.
        callbacks: callbacks that receive the number of finished datasets, the progress of calibrations, and one line
            for each dataset that failed.

    Returns:
        What the workers did, one entry per dataset.

    Raises:
        GearError: a dataset could not be predicted, or the engine cannot be used.
    """
    on_gpu = str(getattr(guarded.model, "device", "cpu")).startswith("cuda")
    engine = open_engine(
        request.engine,
        workers=request.engine_workers,
        backend="evaluation",
        address=request.address,
        needs=Needs(silence_s=math.inf, gpus=int(on_gpu)),
    )
    found = [Predicted() for _ in datasets]
    finished = 0

    def report(outcome: Outcome) -> None:
        nonlocal finished
        if outcome.kind == "failed":
            callbacks.on_warning(f"{datasets[outcome.index].root}: {outcome.error}")
            return
        assert isinstance(outcome.value, Predicted)
        found[outcome.index] = outcome.value
        finished += 1
        callbacks.on_progress(finished, len(datasets))

    callbacks.on_progress(0, len(datasets))
    work = partial(predict_datasets, request, str(Path.cwd()))
    task = datasets[0].plan.task["name"]
    notes = JobNotes(root=request.folder(task), names=[str(one.root) for one in datasets])
    failed = run_jobs(engine, work, range(len(datasets)), report, callbacks=callbacks, notes=notes)
    if failed:
        raise GearError(notes.summary(failed, "datasets"))
    return found


def predict_datasets(request: EvaluateRequest, folder: str | None, indices: Iterator[int], report: Report) -> None:
    """Predicts some datasets of an evaluation; runs in a worker.

    Args:
        request: the evaluation, whose folder has its `plan.json`.
        folder: current folder of the command; None if it is that of the worker.
        indices: positions of the datasets.
        report: called with the outcome of each dataset.

    Raises:
        GearError: the model or the datasets cannot be opened on the worker's machine.
    """
    with shared_folder(folder):
        chosen = chosen_model(request.model, request.model_settings)
        datasets = opened(request.data, request.split, chosen, request.reports)
        task, names = datasets[0].plan.task["name"], row_names(datasets)
        calibrations = CalibrationReports(report=report)
        guard = open_guard(request.guard, [chosen], task, callbacks=calibrations.callbacks())
        guarded = GuardedModel(chosen, guard, seed=request.seed)

        def call(index: int) -> Predicted:
            calibrations.index = index
            row = measure_dataset(request, datasets[index], names[index], guarded, lambda: None)
            store_fit(request.folder(task), guarded)
            return Predicted(made=row.made, damaged=row.damaged)

        carry_out_jobs(call, indices, report)
