"""Every metric of a benchmark by scene, as flat records for metrics.csv and metrics.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gear.measuring.metric_json import known_json
from gear.values.serial import Json
from gear.verbs.bench.detection import DetectionRate, detection_rates
from gear.verbs.bench.paper.tables import scenes_of
from gear.verbs.bench.plan import RANDOM
from gear.verbs.bench.report import BenchReport, Result
from gear.verbs.evaluate.report import Difference, Estimate, Metrics, Pool, RowReport
from gear.verbs.evaluate.table import metric_title

COLUMNS = (
    "task", "model", "defense", "scene", "patch", "samples", "quantity", "metric", "against", "value", "low", "high",
    "p", "ceiling", "from_few_streets",
)  # fmt: skip
"""Columns of metrics.csv. `quantity` is `value`; `change`, the difference to the pictures named in `against`; `mean
change`, the mean over single pictures with its p; `auroc`; `detection`, the share of pictures with an alarm at a
threshold from other scenes, with p against random patches; `false alarms`, the share of clean pictures with an alarm at
the same threshold; `mask`; or `seconds`.
"""

ALL = "all"


def metric_records(report: BenchReport) -> Iterator[dict[str, Json]]:
    """Yields every number of a benchmark as a flat record: for each network, defense, kind of patch and scene, and over
    all scenes (`all`). The keys are `COLUMNS`, the columns of metrics.csv; keys without a value are left out.

    Args:
        report: results of the benchmark.
    """
    scenes = scenes_of(report)
    for task in report.tasks:
        for one in task.results:
            keys = {"task": task.name, "model": one.model, "defense": one.defense or ""}
            for pool in one.evaluation.pools:
                yield from _of(keys, ALL, pool.name, pool, pool.differences, {})
                yield from _detections(
                    {**keys, "scene": ALL, "patch": pool.name}, pool.samples, detection_rates(one, pool)
                )
                for place, (name, scene) in enumerate(zip(pool.rows, scenes, strict=True)):
                    row = next(each for each in one.evaluation.rows if each.name == name)
                    found = tuple(each for each in one.evaluation.differences if each.row == name)
                    yield from _of(keys, scene, pool.name, row, found, _patches(one))
                    rates = detection_rates(one, pool, place)
                    yield from _detections({**keys, "scene": scene, "patch": pool.name}, row.samples, rates)


def _patches(one: Result) -> dict[str, str]:
    """The kind of patch of each dataset, by the name of the dataset."""
    return {name: pool.name for pool in one.evaluation.pools for name in pool.rows}


def _of(
    keys: Mapping[str, Json],
    scene: str,
    patch: str,
    found: RowReport | Pool,
    differences: tuple[Difference, ...],
    kinds: Mapping[str, str],
) -> Iterator[dict[str, Json]]:
    at = {**keys, "scene": scene, "patch": patch, "samples": found.samples}
    yield from _estimates({**at, "quantity": "value"}, found.metrics)
    for name, mean in known_json(found.defense).items():
        yield {**at, "quantity": "mask", "metric": name, "value": mean}
    for name, seconds in found.cost.items():
        yield {**at, "quantity": "seconds", "metric": name, "value": seconds}
    for one in differences:
        against = {**at, "against": kinds.get(one.against, one.against)}
        yield from _estimates({**against, "quantity": "change"}, one.metrics)
        for report, tests in one.paired.items():
            for name, test in tests.items():
                values = known_json({"value": test.mean, "p": test.p})
                yield {**against, "quantity": "mean change", "metric": metric_title(report, name), **values}
        if one.auroc is not None:
            yield {**against, "quantity": "auroc", "metric": "auroc", **_estimate(one.auroc)}


def _detections(at: Mapping[str, Json], samples: int, rates: tuple[DetectionRate, ...]) -> Iterator[dict[str, Json]]:
    for one in rates:
        keys = {**at, "samples": samples, "metric": one.title}
        test = {} if one.p is None else {"against": RANDOM, **known_json({"p": one.p})}
        yield {**keys, "quantity": "detection", **_estimate(one.found), **test}
        yield {**keys, "quantity": "false alarms", **_estimate(one.false_alarms)}


def _estimates(at: Mapping[str, Json], metrics: Metrics) -> Iterator[dict[str, Json]]:
    for report, values in metrics.items():
        for name, one in values.items():
            yield {**at, "metric": metric_title(report, name), **_estimate(one)}


def _estimate(one: Estimate) -> dict[str, Json]:
    found: dict[str, Json] = one.as_json()
    return found
