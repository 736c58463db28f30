"""The pictures that a report shows: those that the patch harms most."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from gear.verbs.bench.pictures.most_changed import most_changed
from gear.verbs.bench.report import Metric, Result, TaskResult
from tests.verbs.bench.synthetic import result, task


def with_samples(values: dict[str, list[Any]], key: str = "miou") -> Result:
    """The undefended network's results, with one metric for each picture of each dataset."""
    one = result(None)
    rows = [
        replace(row, per_sample=[
            {"index": n, "metrics": {"task": {key: value}}} for n, value in enumerate(values.get(row.name, [0.5, 0.5]))
        ])
        for row in one.evaluation.rows
    ]  # fmt: skip
    return replace(one, evaluation=replace(one.evaluation, rows=tuple(rows)))


def places(found: list[Any]) -> list[tuple[int, int]]:
    return [(one.place, one.index) for one in found]


def test_the_worst_comes_first_and_each_scene_once() -> None:
    one = with_samples({"0-none": [0.9, 0.8], "0-patch": [0.1, 0.1], "1-none": [0.6, 0.6], "1-patch": [0.6, 0.5]})
    assert places(most_changed(task(), one, 2)) == [(0, 0), (1, 1)]
    assert places(most_changed(task(), one, 9)) == [(0, 0), (1, 1), (0, 1), (1, 0)]
    (first, *_) = most_changed(task(), one, 1)
    assert (first.metric, first.clean, first.patched) == ("miou", 0.9, 0.1)


def test_help_is_no_harm_and_an_error_grows() -> None:
    one = with_samples({"0-none": [0.1, 0.5], "0-patch": [0.9, 0.4], "1-none": [0.5, 0.5], "1-patch": [0.5, 0.5]})
    assert places(most_changed(task(), one, 1)) == [(0, 1)]
    lower: TaskResult = replace(task(), metric=Metric.of("miou", lower_is_better=True))
    assert places(most_changed(lower, one, 1)) == [(0, 0)]


def test_other_metrics_stand_in_and_missing_ones_come_last() -> None:
    detected = with_samples({"1-none": [1.0, 0.5], "1-patch": [0.0, 0.5]}, "found_share")
    assert places(most_changed(task(), detected, 1)) == [(1, 0)]
    other = with_samples({"0-none": [1.0, 0.5], "0-patch": [1.0, 9.5]}, "silog")
    assert places(most_changed(task(), other, 1)) == [(0, 1)]
    gaps = with_samples({"0-none": [None, 0.5], "0-patch": [0.1, 0.5]})
    found = most_changed(task(), gaps, 9)
    assert places(found)[-1] == (0, 0) and math.isnan(found[-1].clean) and found[-1].metric == ""


def test_without_patched_pictures_there_are_none() -> None:
    one = with_samples({})
    pools = tuple(pool for pool in one.evaluation.pools if pool.name != "patch")
    assert most_changed(task(), replace(one, evaluation=replace(one.evaluation, pools=pools)), 2) == []
