"""`gear.sweep`: runs a benchmark once for each value of a key, and plots the metric over the values."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gear.collecting.workers import Workers
from gear.config.load import find_config
from gear.config.nodes import parse_file
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.dataset.files import write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.store import check_output
from gear.measuring.text_table import number_table
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, Progress, Warn
from gear.values.serial import Json
from gear.verbs.bench.config import BenchConfig, Sweep
from gear.verbs.bench.report import BenchReport
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import run_bench
from gear.verbs.bench.schedule import OnStep
from gear.verbs.bench.sweep_chart import sweep_chart

COLUMNS = ("task", "metric", "model", "defense", "patch", "value", "seeds", "mean", "std")
"""Columns of sweep.csv; `mean` and `std` (standard deviation) are over the seeds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """The metric of one network at one value of the swept key.

    Attributes:
        task, metric: name of the task and of its main metric.
        model, defense: network and defense; `defense` is empty for the network alone.
        patch: kind of patch, such as `none`, `random` or `patch`.
        value: value of the swept key.
        metrics: the metric over all scenes, one per seed; undefined values are left out.
    """

    task: str
    metric: str
    model: str
    defense: str
    patch: str
    value: str
    metrics: tuple[float, ...]

    @property
    def mean(self) -> float:
        """The mean over the seeds."""
        return float(np.mean(self.metrics))

    @property
    def std(self) -> float:
        """The standard deviation over the seeds (divisor N - 1); 0 for one seed."""
        return float(np.std(self.metrics, ddof=1)) if len(self.metrics) > 1 else 0.0

    def as_json(self) -> Json:
        """Returns the point as a flat record: task, metric, network, defense, kind of patch and value, and over the
        seeds their number (`seeds`), `mean` and `std`.
        """
        keys = {name: getattr(self, name) for name in COLUMNS[:6]}
        return {**keys, "seeds": len(self.metrics), "mean": self.mean, "std": self.std}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SweepReport:
    """The results of a sweep.

    Attributes:
        out: folder with sweep.csv, sweep.json and figures.
        sweep: key and values.
        points: the metric of each network, defense, kind of patch and value.
    """

    out: Path
    sweep: Sweep
    points: tuple[Point, ...]

    def as_json(self) -> Json:
        """Returns the content of sweep.json: `key`, `values`, `seeds`, and the `points` as flat records."""
        key = {"key": self.sweep.key, "values": list(self.sweep.values), "seeds": self.sweep.seeds}
        return {"format": "gear-sweep", "version": 1, **key, "points": [point.as_json() for point in self.points]}

    def text(self) -> str:
        """Returns the points as a table."""
        head = ["network", "defense", "patch", self.sweep.title or self.sweep.key, "metric", "mean", "std"]
        rows = [
            [one.model, one.defense or "-", one.patch, one.value, one.metric, f"{one.mean:.4f}", f"{one.std:.4f}"]
            for one in self.points
        ]
        return "\n".join(number_table([head, *rows])) + "\n"


def sweep(
    config: str | Path,
    *,
    out: str | Path,
    settings: Iterable[str] = (),
    device: str | None = None,
    workers: Workers = 1,
    in_subprocess: bool = False,
    log_to: str | None = None,
    log_settings: Iterable[str] = (),
    progress: bool = False,
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> SweepReport:
    """Runs a benchmark once for each value of the config's key `sweep`, and plots the metric over the values. Resumes
    an interrupted run.

    The folder `out` gets `sweep.csv`, `sweep.json`, a figure for each task in `figures`, and one benchmark per value
    and seed in `runs`.

    Args:
        config: name (`gear bench ablation-samples`) or path of a bench config with the key `sweep`.
        out: folder of all results.
        settings: `KEY=VALUE` texts for any key of the config.
        device: device of the networks; overrides the config.
        workers: number of workers of each benchmark, or `auto`.
        in_subprocess: whether a single worker runs in a process of its own.
        log_to, log_settings: logger of each benchmark, as in `gear.bench`.
        progress: shows a progress bar.
        on_step: called with each step of each benchmark, its number (from 1) and the number of steps.
        on_progress: called after every sample of a step, or after every step of an attack.
        on_warning: called with lines on settings that may be unintended, and on results that are made again.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = BenchRequest(
        config=config, out=out, settings=tuple(settings), device=device, workers=workers, in_subprocess=in_subprocess,
        log_to=log_to, log_settings=tuple(log_settings),
    )  # fmt: skip
    callbacks = Callbacks.of(on_progress=on_progress, on_warning=on_warning)
    with displayed(callbacks, "bench", progress=progress) as shown:
        return run_sweep(request, shown, on_step)


def sweep_of(request: BenchRequest) -> tuple[Sweep | None, int]:
    """Reads which key of a bench config takes several values (a sweep).

    Args:
        request: the arguments of `gear.bench`.

    Returns:
        The swept key with its values, None if the config sweeps none; and the config's seed.

    Raises:
        ConfigError: the config cannot be read.
    """
    node = with_overrides(parse_file(find_config("bench", str(request.config))), request.settings, BenchConfig)
    config = read_node(BenchConfig, node)
    return config.sweep, config.seed


def requests_of(request: BenchRequest, chosen: Sweep, seed: int) -> Iterator[tuple[str, BenchRequest]]:
    """Yields the requests of all benchmarks of a sweep, one per value and seed, each with its value.

    Args:
        request: the request of the sweep.
        chosen: key and values.
        seed: the first seed.
    """
    for number, value in enumerate(chosen.values):
        for draw in range(chosen.seeds):
            settings = (*request.settings, "sweep=", f"{chosen.key}={value}", f"seed={seed + draw}")
            out = Path(request.out) / "runs" / f"{number:02d}-seed{seed + draw}"
            yield value, replace(request, out=out, settings=settings)


def run_sweep(
    request: BenchRequest,
    callbacks: Callbacks,
    on_step: OnStep | None = None,
    run: Callable[[BenchRequest, Callbacks, OnStep | None], BenchReport] = run_bench,
) -> SweepReport:
    """Runs a sweep with the arguments in `request`, which `gear.sweep` describes.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.
        on_step: called before each step of each benchmark.
        run: function that runs one benchmark.

    Raises:
        GearError: the config sweeps no key, or a benchmark fails; the message is one line.
    """
    root = Path(request.out)
    check_output(root, "write the sweep into a folder of its own")
    chosen, seed = sweep_of(request)
    if chosen is None:
        raise GearError(f"{request.config}: has no key `sweep`; gear.bench runs it")
    found: dict[tuple[str, str, str, str, str, str], list[float]] = {}
    for value, one in requests_of(request, chosen, seed):
        for key, metric in _metrics(run(one, callbacks, on_step), value):
            found.setdefault(key, []).append(metric)
    points = tuple(
        Point(task=t, metric=m, model=n, defense=d, patch=p, value=v, metrics=tuple(metrics))
        for (t, m, n, d, p, v), metrics in found.items()
    )
    report = SweepReport(out=root, sweep=chosen, points=points)
    _write(report)
    return report


def _metrics(report: BenchReport, value: str) -> Iterator[tuple[tuple[str, str, str, str, str, str], float]]:
    """Yields the metric of each network, defense and kind of patch over all scenes."""
    for task in report.tasks:
        if task.metric is None:
            continue
        for one in task.results:
            for pool in one.evaluation.pools:
                estimate = task.value(pool)
                if estimate is not None and estimate.value == estimate.value:
                    key = (task.name, task.metric.title, one.model, one.defense or "", pool.name, value)
                    yield key, estimate.value


def _write(report: SweepReport) -> None:
    written = io.StringIO()
    table = csv.DictWriter(written, COLUMNS, lineterminator="\n")
    table.writeheader()
    table.writerows(point.as_json() for point in report.points)
    write_whole(report.out, "sweep.csv", written.getvalue().encode())
    write_whole(report.out, "sweep.json", dump_json(report.as_json()))
    write_whole(report.out, "table.txt", report.text().encode())
    for task in dict.fromkeys(point.task for point in report.points):
        lines = [(f"{one.model} {one.defense}".strip(), one) for one in report.points if one.task == task]
        labelled = [(f"{name}, {one.patch}", one.patch, one.value, one.mean, one.std) for name, one in lines]
        title = report.sweep.title or report.sweep.key
        metric = next(one.metric for one in report.points if one.task == task)
        for form in ("pdf", "svg"):
            data = sweep_chart(labelled, report.sweep.values, axes=(title, metric), form=form)
            write_whole(report.out, f"figures/{task.replace('/', '-')}.{form}", data)
