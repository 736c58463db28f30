"""What makes two splits the same, twins, or strangers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gear.dataset.plan import Plan, differences
from gear.testing.task_contract import INFO
from gear.values.serial import Json, from_json

PLAN = Plan(
    task={"name": "semseg", "version": "1"},
    options={"width_px": 64, "height_px": 32},
    content={"town": "a", "weather": "ClearNoon"},
    patch={"label": "none", "sha256": ""},
    info=INFO,
    samples=4,
)

BOARD: dict[str, Json] = {"asset": "billboard", "facing_deg": 205.0, "position_m": [120.0, 29.0]}


@pytest.mark.parametrize(
    ("changes", "is_twin", "is_same"),
    [
        ({"samples": 9}, True, True),
        ({"info": replace(INFO, created="2023-02-02")}, True, True),
        ({"options": {"height_px": 32, "width_px": 64}}, True, True),
        ({"patch": {"label": "random", "sha256": "1"}}, True, False),
        ({"auxiliary": ("probes",)}, True, False),
        ({"options": {"width_px": 32, "height_px": 64}}, False, False),
        ({"content": {"town": "b", "weather": "ClearNoon"}}, False, False),
        ({"task": {"name": "semseg", "version": "2"}}, False, False),
    ],
)
def test_twins_differ_in_their_patch_alone_and_equals_in_how_many_they_are(
    changes: dict[str, Any], is_twin: bool, is_same: bool
) -> None:
    other = replace(PLAN, **changes)
    assert (other.twin_key == PLAN.twin_key) is is_twin
    assert (other.content_key == PLAN.content_key) is is_same


def test_kinds_of_auxiliary_files_are_told_apart() -> None:
    assert replace(PLAN, auxiliary=("probes",)).content_key != replace(PLAN, auxiliary=("others",)).content_key


@pytest.mark.parametrize("auxiliary", [(), ("probes",)])
def test_a_plan_comes_back_and_speaks_of_auxiliary_files_where_there_are_any(auxiliary: tuple[str, ...]) -> None:
    plan = replace(PLAN, auxiliary=auxiliary)
    content = plan.as_json()
    assert ("auxiliary" in content) is bool(auxiliary)
    assert from_json(Plan, content) == plan


def test_differences_are_named_with_both_values_but_for_what_may_differ() -> None:
    other = replace(PLAN, samples=9, info=replace(INFO, created="x"), options={"width_px": 32, "height_px": 32})
    assert differences(PLAN.as_json(), other.as_json()) == ["options.width_px: 64 there, 32 now"]


@pytest.mark.parametrize(
    ("now", "expected"),
    [
        ([BOARD | {"facing_deg": 20.0}], ["boards[0].facing_deg: 205.0 there, 20.0 now"]),
        ([BOARD | {"position_m": [9.0, 29.0]}], ["boards[0].position_m[0]: 120.0 there, 9.0 now"]),
        ([BOARD, 1], ["boards[1]: null there, 1 now"]),
        ([], ['boards[0]: {"asset": "billboard", "facing_deg": ... there, null now']),
    ],
)
def test_differences_in_lists_are_named_by_their_place(now: list[Json], expected: list[str]) -> None:
    assert differences({"boards": [BOARD]}, {"boards": now}) == expected
