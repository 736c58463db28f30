"""What a bench shows of objects: columns of its table, lines of bench.csv, and bench.json."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gear.measuring.text_table import number_table
from gear.verbs.bench.report import COLUMNS, BenchReport, Metric, Result, TaskResult
from gear.verbs.bench.table import columns
from gear.verbs.evaluate.report import (
    ChangeCount,
    Difference,
    Estimate,
    EvaluateReport,
    ObjectChanges,
    PairedTest,
    Pool,
)

TEST = PairedTest(mean=0.5, p=0.03, pairs=8)
NAMES = ("hidden", "misclassified", "moved", "invented_on_patch", "invented_elsewhere")
CHANGES = ObjectChanges(
    found=20,
    counts={
        name: ChangeCount(count=i, reverse=0, rate=Estimate(value=i / 20, interval=(0.0, i / 10)), paired=TEST)
        for i, name in enumerate(NAMES, 1)
    },
    changes=(),
    by_distance={},
)


def bench(objects: ObjectChanges | None) -> BenchReport:
    facts: dict[str, Any] = {"rows": (), "samples": 8, "cost": {"model_s": 0.1, "defense_s": 0.0}, "defense": {}}
    facts["metrics"] = {"task": {"ap": Estimate(value=0.5)}}
    difference = Difference(row="patch", against="random", metrics={}, auroc=None, paired={}, objects=objects)
    pools = (
        Pool(name="none", differences=(), **facts),
        Pool(name="random", differences=(replace(difference, row="random", against="none"),), **facts),
        Pool(name="patch", differences=(difference,), **facts),
    )
    evaluation = EvaluateReport(out=Path("out/e"), facts={}, rows=(), together=(), differences=(), pools=pools)
    result = Result(model="net", defense=None, evaluation=evaluation, scenes=())
    task = TaskResult(name="detect2d", metric=Metric(report="task", name="ap"), results=(result,))
    return BenchReport(out=Path("out"), facts={}, tasks=(task,))


def test_detectors_have_columns_of_objects_against_the_twin_of_change() -> None:
    (task,) = bench(CHANGES).tasks
    head, none, random, patch = columns(task)
    begin = head.index("hidden")
    assert head[begin : begin + 5] == [name.replace("_", " ") for name in NAMES]
    assert none[begin : begin + 5] == [""] * 5
    assert random[begin] == patch[begin] == "0.050 [0.000, 0.100]"
    assert max(map(len, number_table(columns(task)))) <= 100


def test_csv_and_json_have_every_count() -> None:
    report = bench(CHANGES)
    written = io.StringIO()
    table = csv.DictWriter(written, COLUMNS)
    table.writeheader()
    table.writerows(report.records())
    lines = list(csv.DictReader(io.StringIO(written.getvalue())))
    rates = {(line["patch"], line["metric"]): (line["against"], float(line["value"])) for line in lines}
    assert rates["patch", "objects.moved"] == ("random", pytest.approx(0.15))
    assert rates["random", "objects.hidden"] == ("none", pytest.approx(0.05))
    assert rates["none", "ap"] == ("", 0.5) and len(lines) == 3 + 2 * len(NAMES)
    pools = report.as_json()["tasks"]["detect2d"]["results"][0]["patches"]
    assert pools["patch"]["objects"]["counts"]["hidden"]["paired"]["p"] == 0.03 and "objects" not in pools["none"]


def test_tasks_without_objects_have_no_such_column() -> None:
    report = bench(None)
    assert not set(columns(report.tasks[0])[0]) & {"hidden", "moved", "invented on patch"}
    assert [line["metric"] for line in report.records()] == ["ap"] * 3
