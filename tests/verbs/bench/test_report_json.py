"""The results of a task as JSON."""

from __future__ import annotations

import json

import pytest

from gear.verbs.bench.report_json import task_json
from gear.verbs.bench.table import columns, text
from tests.verbs.bench.synthetic import report, task


def test_change_is_against_the_undefended_clean_network() -> None:
    every = report()
    found = json.loads(json.dumps(task_json(every.tasks[0], every.out)))
    bare, cleaner, _ = found["results"]
    patch = cleaner["patches"]["patch"]
    assert patch["change"]["value"] == pytest.approx(-0.15) and patch["gain"]["value"] == pytest.approx(0.05)
    assert (patch["against"], patch["effect"]["value"]) == ("random", pytest.approx(-0.12))
    assert bare["patches"]["none"]["change"] is None and bare["patches"]["patch"]["gain"] is None


def test_failed_attacks_are_marked_in_tables() -> None:
    rows = columns(task(p=0.3))
    assert [row[2] for row in rows[1:4]] == ["none", "random", "patch (failed)"]
    assert "(failed): the patches are no worse than random ones" in text(report())
