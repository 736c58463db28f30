"""The results of a benchmark, as dataclasses and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from gear.contracts.tasks import NO_PATCH
from gear.measuring.object_report import OBJECTS
from gear.measuring.reports import OUTSIDE_PATCH, TASK
from gear.values.serial import Json
from gear.verbs.bench.drives.results import DriveSection
from gear.verbs.bench.plan import RANDOM
from gear.verbs.evaluate.report import Difference, Estimate, EvaluateReport, Metrics, PairedTest, Pool
from gear.verbs.evaluate.table import metric_title

FOUND_SHARE = "found_share"
"""Metric of single samples, for tasks whose main metric is defined only for whole datasets."""


COLUMNS = (
    "task",
    "model",
    "defense",
    "scene",
    "weather",
    "patch",
    "samples",
    "metric",
    "value",
    "low",
    "high",
    "ceiling",
    "from_few_streets",
    "against",
)
"""Columns of bench.csv. `against` is the kind of patch in the pictures with which detected objects are compared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Metric:
    """The metric by which the networks of a task are compared.

    Attributes:
        report: name of the metric report that contains it; `task` is the task's own evaluator.
        name: name of the metric in the report.
        lower_is_better: whether smaller values are better, as for errors.
    """

    report: str
    name: str
    lower_is_better: bool = False

    @classmethod
    def of(cls, metric: str, *, lower_is_better: bool) -> Metric:
        """Parses the name of a metric, such as `miou`, or with its report, such as `reference.car_bev_moderate_r40`.

        Args:
            metric: the name.
            lower_is_better: whether smaller values are better, as for errors.
        """
        report, dot, name = metric.rpartition(".")
        return cls(report=report if dot else TASK, name=name, lower_is_better=lower_is_better)

    @property
    def title(self) -> str:
        """The name of the metric in tables, with the name of its report unless that is the task's own."""
        return metric_title(self.report, self.name)

    def among(self, metrics: Metrics) -> Estimate | None:
        """Returns the value of this metric from `metrics`, the estimates by report and name; None if it is missing."""
        return metrics.get(self.report, {}).get(self.name)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneMetric:
    """The task's main metric in one scene.

    Attributes:
        scene, weather: names of the scene and of the weather.
        patch: kind of patch in the pictures, such as `none`, `random` or `patch`.
        samples: number of samples.
        value: value of the metric, with its interval.
    """

    scene: str
    weather: str
    patch: str
    samples: int
    value: Estimate


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Result:
    """The results of one network, alone or guarded by a defense.

    Attributes:
        model, defense: names in the config; `defense` is None for the network alone.
        evaluation: the evaluation with all metrics.
        scenes: the task's main metric in each scene.
        changes_pictures: whether the defense changes pictures; a defense that only detects patches does not.
    """

    model: str
    defense: str | None
    evaluation: EvaluateReport
    scenes: tuple[SceneMetric, ...]
    changes_pictures: bool = True

    def pool(self, patch: str) -> Pool:
        """Returns the results over all scenes with one kind of patch.

        Args:
            patch: kind of patch, such as `none`, `random` or `patch`.

        Raises:
            KeyError: the network was not measured with this kind of patch.
        """
        for pool in self.evaluation.pools:
            if pool.name == patch:
                return pool
        raise KeyError(patch)

    def against(self, pool: Pool) -> Difference | None:
        """Returns the differences between a pool and its control pool; a pool is the datasets of all scenes with one
        kind of patch.

        The control of the random patch is no patch; the control of every other patch is the random patch.

        Args:
            pool: a pool of these results.

        Returns:
            The differences; None if they were not measured.
        """
        control = NO_PATCH if pool.name == RANDOM else RANDOM
        return next((one for one in pool.differences if one.against == control), None)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TaskResult:
    """The results of one task.

    Attributes:
        name: name of the task.
        metric: metric by which networks are compared; None if the task has none.
        results: results per network and defense, in the order of the config.
    """

    name: str
    metric: Metric | None
    results: tuple[Result, ...]

    def value(self, pool: Pool) -> Estimate | None:
        """Returns the task's main metric of a pool (the datasets of all scenes with one kind of patch); None if it
        is missing.
        """
        return None if self.metric is None else self.metric.among(pool.metrics)

    def effect(self, one: Difference | None) -> Estimate | None:
        """Returns the change of the task's main metric between two pools of one evaluation; None if it is missing."""
        return None if self.metric is None or one is None else self.metric.among(one.metrics)

    def outside_patch(self, one: Difference | None) -> tuple[str, PairedTest] | None:
        """Returns the paired test over single samples of a comparison of two datasets.

        If the task supports the report `outside_patch`, the tested metric excludes the pixels of the patch.

        Args:
            one: the comparison; None if there is none.

        Returns:
            The title of the tested metric, and the test; None if nothing was tested.
        """
        if one is None:
            return None
        report = OUTSIDE_PATCH if OUTSIDE_PATCH in one.paired else TASK
        tests = one.paired.get(report, {})
        wanted = ("" if self.metric is None else self.metric.name, FOUND_SHARE, *tests)
        name = next((name for name in wanted if name in tests), None)
        return None if name is None else (metric_title(report, name), tests[name])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BenchReport:
    """The results of a whole bench.

    Attributes:
        out: folder with bench.json, bench.csv, table.txt and report.html.
        facts: config, scenes, weathers, versions and notes; JSON.
        tasks: results of each task, in the order of the config.
        drives: collision rates of the drives; None if the config has no drives.
    """

    out: Path
    facts: Json
    tasks: tuple[TaskResult, ...]
    drives: DriveSection | None = None

    def as_json(self) -> Json:
        """Returns the content of bench.json: the entries of `facts`, and under `tasks` the metric and the results of
        each task, by name.
        """
        from gear.verbs.bench.report_json import task_json  # which needs the classes of this module

        return {
            "format": "gear-bench",
            "version": 1,
            **self.facts,
            "tasks": {task.name: task_json(task, self.out) for task in self.tasks},
            **({} if self.drives is None else {"drives": self.drives.as_json()}),
        }

    @property
    def title(self) -> str:
        """The title of the report: the name of the bench config."""
        return f"gear bench {self.facts['name']}"

    def records(self) -> Iterator[Mapping[str, Json]]:
        """Yields the lines of bench.csv as flat records; the keys are `COLUMNS`, and keys without a value are left out.

        A pool is all scenes with one kind of patch. The task's main metric has one record per pool and one per scene.
        For detectors, each kind of change of the detected objects has one record per pool.
        """
        for task in self.tasks:
            for one in task.results:
                keys = {"task": task.name, "model": one.model, "defense": one.defense or ""}
                metric = "" if task.metric is None else task.metric.title
                for pool in one.evaluation.pools:
                    where = {"scene": "all", "weather": "all", "patch": pool.name, "samples": pool.samples}
                    value, against = task.value(pool), one.against(pool)
                    if value is not None:
                        yield {**keys, **where, "metric": metric, **value.as_json()}
                    if against is not None and against.objects is not None:
                        for name, count in against.objects.counts.items():
                            title = metric_title(OBJECTS, name)
                            yield {**keys, **where, "metric": title, **count.rate.as_json(), "against": against.against}
                for at in one.scenes:
                    where = {"scene": at.scene, "weather": at.weather, "patch": at.patch, "samples": at.samples}
                    yield {**keys, **where, "metric": metric, **at.value.as_json()}
