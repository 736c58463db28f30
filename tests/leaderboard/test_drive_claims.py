"""Claims about drives: what is refused, and the collision rates that follow from them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from gear.leaderboard.drive_claims import crashes
from gear.leaderboard.reading import encoded, read_record
from gear.values.errors import FieldError
from tests.leaderboard.conftest import drive, driving, plugin, record


def test_collision_rates_follow_from_the_drives_without_free_roads() -> None:
    one = driving(record(), {"none": 0, "patch": 3})
    assert crashes(one.drives, "patch") == [True, True, True, False] and crashes(one.drives, "none") == [False] * 4
    free = dataclasses.replace(one, drives=(*one.drives, drive("patch", 9, is_free=True)))
    assert crashes(free.drives, "patch") == crashes(one.drives, "patch") and crashes(free.drives, "other") == []


@pytest.mark.parametrize(
    "change",
    [
        {"scene": "../x"}, {"scenario": "<b>"}, {"speed_kmh": float("nan")}, {"speed_kmh": -1.0}, {"seed": -1},
        {"score": 1.5}, {"log_sha256": "x"}, {"patch": ""},
        {"weather": "../x"},
    ],
)  # fmt: skip
def test_impossible_claims_are_refused(change: dict[str, Any]) -> None:
    with pytest.raises(FieldError):
        drive(**({"patch": "patch"} | change))


def test_a_record_has_each_drive_once_and_a_controller() -> None:
    one = driving(record(), {"patch": 1})
    with pytest.raises(FieldError, match="twice"):
        dataclasses.replace(one, drives=(*one.drives, dataclasses.replace(one.drives[0], is_crash=False)))
    with pytest.raises(FieldError, match="controller"):
        dataclasses.replace(one, controller=None)
    with pytest.raises(FieldError, match="controller"):
        dataclasses.replace(record(), controller=plugin("depth_baseline"))


def test_records_with_and_without_drives_are_read_back(tmp_path: Path) -> None:
    for one in (record(), driving(record(), {"none": 0, "patch": 3})):
        (tmp_path / "one.json").write_bytes(encoded(one))
        assert read_record(tmp_path / "one.json").record == one
