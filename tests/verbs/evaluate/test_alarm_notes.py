"""When an alarm level is said not to carry over to the measured scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gear.verbs.evaluate.alarm_notes import alarm_notes
from gear.verbs.evaluate.report import RowReport

FIT = {"values": {"false_alarms_high": 0.13}, "problems": []}


def row(alarms: int, of: int, patch: str = "none") -> RowReport:
    return RowReport(
        name="b02", dataset=Path("b02"), facts={"patch": patch}, samples=of, made=of, damaged=(), metrics={}, cost={},
        defense={"alarms": alarms / of}, per_sample=[],
    )  # fmt: skip


def test_a_level_that_does_not_carry_over_is_a_warning() -> None:
    (note,) = alarm_notes([row(28, 40)], FIT)
    assert note.startswith("WARNING: b02: 70% of 40 clean pictures raise the alarm") and "at most 13%" in note


@pytest.mark.parametrize(
    ("shown", "fit"),
    [
        (row(0, 40), FIT),
        (row(8, 40), FIT),  # 9 to 36 %, by the draw of these pictures
        (row(40, 40, patch="random"), FIT),
        (row(40, 40), None),
        (row(40, 40), {"values": {"loss": 0.1}, "problems": []}),
    ],
)
def test_alarms_that_chance_or_a_patch_explains_are_none(shown: RowReport, fit: Any) -> None:
    assert alarm_notes([shown], fit) == []
