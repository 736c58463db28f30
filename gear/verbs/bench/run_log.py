"""Logs a benchmark (`--log-to`): the main metric of every network and defense, the tables, and the sheets of pictures.

The attacks of the benchmark log their curves in the folders of their patches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from gear.dataset.files import inside, read_bytes
from gear.formats.png import decode_rgb
from gear.measuring.run_log import RunLog
from gear.reporting.directions import with_direction
from gear.values.frames import UInt8Image
from gear.verbs.bench.plan import Step
from gear.verbs.bench.report import BenchReport, Result
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.table import text


def with_log(steps: Sequence[Step], request: BenchRequest) -> list[Step]:
    """Returns the steps of a benchmark; the attacks among them log their runs if the benchmark has a logger.

    Args:
        steps: the steps.
        request: arguments of the benchmark.
    """
    given = {"log_to": request.log_to, "log_settings": request.log_settings}
    if request.log_to is None:
        return list(steps)
    return [replace(step, arguments=step.arguments | given) if step.verb == "attack" else step for step in steps]


def log_report(log: RunLog, report: BenchReport) -> None:
    """Logs a finished benchmark and closes the log.

    The step of an entry is the number of the evaluation, counted from 1 in the order of the tables.

    Args:
        log: the log.
        report: results of the benchmark.
    """
    if not log.is_on:
        return
    log.begin(0, report.facts["config"])
    for number, (name, value) in enumerate(_values(report), 1):
        log.scalar(name, value, number)
    log.text("tables", f"```\n{text(report)}```", 0)
    sheets = [
        (f"{task.name}/{_network(one)}/{row.name}", one.evaluation.out, row.pictures)
        for task in report.tasks
        for one in task.results
        for row in one.evaluation.rows
        if row.pictures is not None
    ]
    for name, root, path in sheets:
        log.pictures(0, lambda name=name, root=root, path=path: {name: _read(root, path)})  # type: ignore[misc]
    log.close()


def _values(report: BenchReport) -> Iterator[tuple[str, float]]:
    """Yields the main metric of every network, defense and kind of patch with its name."""
    for task in report.tasks:
        for one in task.results if task.metric is not None else ():
            assert task.metric is not None
            title = with_direction(task.metric.title, lower_is_better=task.metric.lower_is_better)
            for pool in one.evaluation.pools:
                value = task.value(pool)
                yield f"{task.name} {title}/{_network(one)}/{pool.name}", math.nan if value is None else value.value


def _network(result: Result) -> str:
    """Returns the names of a network and of its defense, if it has one."""
    return " + ".join(filter(None, (result.model, result.defense)))


def _read(root: Path, relative: str) -> UInt8Image:
    """Reads a sheet of an evaluation as (H, W, 3) uint8 RGB."""
    return decode_rgb(read_bytes(inside(root, relative)))
