"""The bars of a bench: what they carry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from gear.verbs.bench.chart import chart
from gear.verbs.bench.report import Metric, Result, TaskResult
from gear.verbs.evaluate.report import Estimate, EvaluateReport, Pool


def task(*values: Estimate) -> TaskResult:
    facts: dict[str, Any] = {"rows": (), "cost": {}, "defense": {}, "differences": ()}
    pools = tuple(
        Pool(name=name, samples=1, metrics={"task": {"ap": value}}, **facts)
        for name, value in zip(("none", "random"), values, strict=True)
    )
    evaluation = EvaluateReport(out=Path(), facts={}, rows=(), together=(), differences=(), pools=pools)
    result = Result(model="net", defense=None, evaluation=evaluation, scenes=())
    return TaskResult(name="detect2d", metric=Metric(report="task", name="ap"), results=(result,))


def whiskers(*values: Estimate) -> int:
    return chart(task(*values), "svg").count(b'id="LineCollection')


def test_bars_without_an_interval_have_no_whisker() -> None:
    """One of no length said that the metric is certain."""
    sure, bare = Estimate(value=0.4, interval=(0.3, 0.5)), Estimate(value=0.2)
    assert [whiskers(sure, sure), whiskers(sure, bare), whiskers(bare, bare)] == [2, 1, 0]


def test_a_chart_without_results_has_no_bars() -> None:
    missing = Estimate(value=float("nan"))
    assert whiskers(missing, missing) == 0


def test_the_pdf_embeds_truetype_fonts_at_the_width_of_a_column() -> None:
    data = chart(task(Estimate(value=0.4), Estimate(value=0.2)), "pdf")
    assert b"/Type3" not in data and b"/CIDFontType2" in data
    found = re.search(rb"/MediaBox \[ 0 0 ([0-9.]+) ", data)
    assert found is not None and 230 < float(found[1]) < 260, "3.5 inches are 252 points"
