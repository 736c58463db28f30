"""The result tables of a bench."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from gear.verbs.bench import table
from gear.verbs.bench.report import Metric


def task(metric: Metric | None) -> Any:
    return SimpleNamespace(name="depth", metric=metric, results=())


def test_the_title_says_which_direction_is_better() -> None:
    assert table.title(task(Metric.of("rmse_m", lower_is_better=True))) == "depth: rmse_m (lower is better)"
    assert table.title(task(Metric.of("miou", lower_is_better=False))) == "depth: miou (higher is better)"
    assert table.title(task(None)) == "depth"


def test_the_metric_names_its_column_and_empty_columns_are_left_out() -> None:
    one = task(Metric.of("miou", lower_is_better=False))
    assert table.head(one)[3] == "miou"
    assert table.head(task(None))[3] == ""
    assert table.columns(one) == [[]]
