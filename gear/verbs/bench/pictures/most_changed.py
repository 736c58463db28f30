"""Chooses the pictures of a benchmark in which a patch changed a network's predictions most."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gear.contracts.tasks import NO_PATCH
from gear.measuring.reports import TASK
from gear.values.serial import Json
from gear.verbs.bench.plan import PATCH
from gear.verbs.bench.report import FOUND_SHARE, Result, TaskResult


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """The sample whose picture a report shows for a patch.

    Attributes:
        place: position of the scene (with its weather) in the benchmark.
        index: index of the sample in the scene's datasets.
        metric: name of the metric by which it was chosen; "" if no metric is defined for single pictures.
        clean, patched: the metric in this picture without and with the patch; NaN without a metric.
    """

    place: int
    index: int
    metric: str
    clean: float
    patched: float


def most_changed(task: TaskResult, one: Result, count: int) -> list[Chosen]:
    """Returns the pictures in which the patch harms a network most, the worst first, each of another scene as long as
    there are any.

    The metric is the task's main metric if it is defined for single pictures, otherwise the share of found objects or
    the first metric of the task.

    Args:
        task: results of the task, with its main metric.
        one: results of the network without a defense.
        count: largest number of pictures.
    """
    pools = {pool.name: pool for pool in one.evaluation.pools}
    if NO_PATCH not in pools or PATCH not in pools:
        return []
    rows = {row.name: row for row in one.evaluation.rows}
    found = []
    for place, names in enumerate(zip(pools[NO_PATCH].rows, pools[PATCH].rows, strict=True)):
        clean, patched = (rows[name] for name in names)
        found += [_compared(task, place, *pair) for pair in zip(clean.per_sample, patched.per_sample, strict=False)]
    found.sort(key=lambda each: (-_harm(task, each), each.place, each.index))
    worst_of_scene: dict[int, Chosen] = {}
    for each in found:
        worst_of_scene.setdefault(each.place, each)
    others = (each for each in found if worst_of_scene[each.place] is not each)
    return [*worst_of_scene.values(), *others][:count]


def _compared(task: TaskResult, place: int, clean: Json, patched: Json) -> Chosen:
    metric = task.metric
    own = clean["metrics"].get(TASK, {})
    wanted = [] if metric is None else [(metric.report, metric.name)]
    wanted += [(TASK, FOUND_SHARE), *((TASK, name) for name in own)]
    for report, name in wanted:
        here, there = (one["metrics"].get(report, {}).get(name) for one in (clean, patched))
        if here is not None and there is not None:
            return Chosen(place=place, index=clean["index"], metric=name, clean=here, patched=there)
    return Chosen(place=place, index=clean["index"], metric="", clean=math.nan, patched=math.nan)


def _harm(task: TaskResult, one: Chosen) -> float:
    """How much the patch harms a picture; the size of the change if the metric is not the task's main metric."""
    change = one.patched - one.clean
    if not math.isfinite(change):
        return -math.inf
    if task.metric is not None and one.metric == task.metric.name:
        return change if task.metric.lower_is_better else -change
    return -change if one.metric == FOUND_SHARE else abs(change)
