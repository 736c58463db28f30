"""`gear bench times`: measures the seconds that each task needs for one sample, as in the CARLA-GeAR paper's figure."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gear.collecting.job import versions
from gear.config.load import find_config
from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Node, Place, parse_file
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.dataset.files import inside, write_whole
from gear.dataset.json_text import dump_json, load_json
from gear.dataset.locks import exclusive_lock
from gear.dataset.store import check_output
from gear.measuring.text_table import number_table
from gear.values.errors import DatasetError, FieldError, GearError
from gear.values.progress import Callbacks
from gear.values.serial import Json
from gear.verbs.bench.chart import TRUETYPE, UNDATED
from gear.verbs.bench.config import settings_of
from gear.verbs.bench.plan import Step
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.schedule import OnStep
from gear.verbs.collect.run import collect

MOST = 1000
MOST_SECONDS = 1e9
"""Largest time of a sample that a stored file may hold."""

WIDTH_IN, HEIGHT_IN, TEXT_PT = 3.5, 2.2, 7


@dataclass(frozen=True, slots=True, kw_only=True)
class Times:
    """The collections of samples whose time is measured.

    Attributes:
        tasks: names of task plugins.
        town, scene: where the samples are collected.
        samples: number of samples of each collection.
        seeds: number of collections of each task, with different seeds.
        collect: further collection settings.
    """

    tasks: tuple[str, ...]
    town: str
    scene: str
    samples: int = 50
    seeds: int = 10
    collect: Node = field(default_factory=lambda: MappingNode({}, Place("defaults")))

    def __post_init__(self) -> None:
        if not self.tasks:
            raise FieldError("tasks", "names no task")
        for name, least in (("samples", 2), ("seeds", 1)):
            if not least <= getattr(self, name) <= MOST:
                raise FieldError(name, f"must be {least} to {MOST}, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TimesConfig:
    """A config of `gear bench` that measures times; it has the single key `times`."""

    times: Times


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TimesReport:
    """Seconds per sample of each task.

    Attributes:
        out: folder with times.csv, times.json and figures/times.pdf.
        seconds: seconds of every sample but the first of each collection, by task.
    """

    out: Path
    seconds: dict[str, tuple[float, ...]]

    def records(self) -> list[Json]:
        """Returns one record per task with the keys `task`, `samples`, `mean_s`, `std_s` (divisor N - 1) and
        `median_s`, in seconds per sample.
        """
        return [
            {
                "task": task,
                "samples": len(values),
                "mean_s": float(np.mean(values)),
                "std_s": float(np.std(values, ddof=1)) if len(values) > 1 else 0.0,
                "median_s": float(np.median(values)),
            }
            for task, values in self.seconds.items()
        ]

    def as_json(self) -> Json:
        """Returns the content of times.json: `versions` of packages, and under `tasks` one record per task."""
        return {"format": "gear-times", "version": 1, "versions": versions(), "tasks": self.records()}

    def text(self) -> str:
        """Returns the times as a table."""
        rows = [[str(one["task"]), str(one["samples"]), *(f"{one[key]:.3f}" for key in KEYS)] for one in self.records()]
        return "\n".join(number_table([["task", "samples", *KEYS], *rows])) + "\n"


KEYS = ("mean_s", "std_s", "median_s")


def measures_times(request: BenchRequest) -> bool:
    """Whether a config has the key `times`, and therefore measures times of collections instead of networks.

    Args:
        request: the arguments of `gear.bench`.

    Raises:
        ConfigError: there is no such config.
    """
    node = parse_file(find_config("bench", str(request.config)))
    return isinstance(node, MappingNode) and "times" in node.entries


def times_of(request: BenchRequest) -> Times:
    """Reads which collections of samples are timed, from the key `times` of a benchmark's config.

    Args:
        request: the arguments of `gear.bench`.

    Raises:
        ConfigError: the config cannot be read.
    """
    node = with_overrides(parse_file(find_config("bench", str(request.config))), request.settings, TimesConfig)
    return read_node(TimesConfig, node).times


def steps_of(config: Times, root: Path) -> Iterator[tuple[str, Step]]:
    """Yields the name of every collection whose time is measured, and the step that makes it; nothing is run.

    Args:
        config: tasks, number of seeds, scene and number of samples.
        root: folder of the benchmark; the data go into `data/<name>`.
    """
    for task in config.tasks:
        for seed in range(config.seeds):
            name = f"{task.replace('/', '-')}-seed{seed}"
            arguments = {
                "task": task,
                "town": config.town,
                "scene": config.scene,
                "split": "test",
                "seed": seed,
                "samples": config.samples,
                "out": str(root / "data" / name),
                "settings": tuple(settings_of(config.collect)),
            }
            yield name, Step(verb="collect", title=f"collect {task} with seed {seed}", arguments=arguments)


def run_times(
    request: BenchRequest, callbacks: Callbacks, on_step: OnStep | None = None, run: Callable[..., Any] = collect
) -> TimesReport:
    """Collects every task with every seed, one after the other in this process, and measures the time of each sample.

    Finished collections are not repeated; an interrupted collection is made again from its beginning.

    Args:
        request: the arguments of `gear.bench`.
        callbacks: callbacks that receive progress and warnings.
        on_step: called before each collection.
        run: the function that collects.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    if request.log_to is not None:
        raise GearError(f"{request.config}: measures times, and has nothing to log; leave --log-to out")
    root, config = Path(request.out), times_of(request)
    check_output(root, "write the times into a folder of its own")
    seconds: dict[str, tuple[float, ...]] = {}
    steps = list(steps_of(config, root))
    with exclusive_lock(root, callbacks.on_warning):
        for number, (name, step) in enumerate(steps, 1):
            if on_step is not None:
                on_step(step, number, len(steps))
            task = step.arguments["task"]
            seconds[task] = (*seconds.get(task, ()), *_measured(root, name, step, callbacks, run))
        report = TimesReport(out=root, seconds=seconds)
        _write(report)
    return report


def _measured(root: Path, name: str, step: Step, callbacks: Callbacks, run: Callable[..., Any]) -> tuple[float, ...]:
    """Returns the seconds of each sample of a collection but the first, which also compiles the town.

    Raises:
        DatasetError: the stored file is of another collection, or holds no seconds.
    """
    path = inside(root, f"times/{name}.json")
    arguments = {**step.arguments, "settings": list(step.arguments["settings"])}
    arguments["out"] = Path(step.arguments["out"]).relative_to(root).as_posix()
    if path.exists():
        there = load_json(path)
        if not isinstance(there, dict) or there.get("arguments") != arguments:
            raise DatasetError(path, "is the time of another collection; use another --out, or remove it")
        return _stored(path, there.get("seconds"))
    ends: list[float] = []

    def finished(done: int, total: int) -> None:
        if done:
            ends.append(time.perf_counter())
        callbacks.on_progress(done, total)

    run(**step.arguments, on_progress=finished, on_warning=callbacks.on_warning, force=True)
    found = tuple(float(value) for value in np.diff(ends))
    write_whole(root, f"times/{name}.json", dump_json({"arguments": arguments, "seconds": list(found)}))
    return found


def _stored(path: Path, seconds: Json) -> tuple[float, ...]:
    """Returns the seconds of a stored file.

    Raises:
        DatasetError: they are no list of numbers of 0 or more.
    """
    is_list = isinstance(seconds, list) and len(seconds) > 0
    if not is_list or not all(type(one) in (int, float) and 0 <= one <= MOST_SECONDS for one in seconds):
        raise DatasetError(path, "holds no list of seconds; remove it, and the collection is measured again")
    return tuple(float(one) for one in seconds)


def _write(report: TimesReport) -> None:
    lines = [("task", "samples", *KEYS), *(tuple(one.values()) for one in report.records())]
    text = "".join(",".join(map(str, line)) + "\n" for line in lines)
    write_whole(report.out, "times.csv", text.encode())
    write_whole(report.out, "times.json", dump_json(report.as_json()))
    write_whole(report.out, "table.txt", report.text().encode())
    for form in ("pdf", "svg"):
        write_whole(report.out, f"figures/times.{form}", times_chart(report.records(), form))


def times_chart(records: Sequence[Json], form: str) -> bytes:
    """Draws mean seconds per sample as bars with standard deviations, one bar per task.

    Args:
        records: one mapping per task with the keys `task`, `mean_s` and `std_s`.
        form: `pdf` or `svg`.

    Returns:
        The bytes of the file.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), layout="constrained")
    FigureCanvasAgg(figure)
    axis = figure.subplots()
    places = range(len(records))
    means, stds = ([one[key] for one in records] for key in ("mean_s", "std_s"))
    axis.bar(places, means, 0.6, yerr=stds, color="#2f6f9f", capsize=2)
    axis.set_xticks(list(places), [one["task"] for one in records], fontsize=TEXT_PT)
    axis.set_ylabel("seconds per sample", fontsize=TEXT_PT)
    axis.tick_params(labelsize=TEXT_PT)
    axis.set_ylim(bottom=0)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)
    data = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": "gear", "svg.fonttype": "path", "pdf.fonttype": TRUETYPE}):
        figure.savefig(data, format=form, metadata=UNDATED[form])
    return data.getvalue()
