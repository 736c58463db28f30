"""What makes two splits the same, twins, or strangers."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gear.dataset.plan import Plan, differences, read_plan, write_plan
from gear.dataset.sealed_json import DamagedError
from gear.dataset.store import Store
from gear.testing.task_contract import INFO
from gear.values.errors import DatasetError
from gear.values.serial import Json, from_json
from tests.dataset.splits import fill, plan, tree

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
        ({"key_points": "1"}, True, False),
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


def test_kinds_of_auxiliary_files_are_distinguished() -> None:
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


@pytest.mark.parametrize("is_closed", [True, False])
def test_a_damaged_plan_never_ends_in_the_advice_to_replace_the_split(tmp_path: Path, is_closed: bool) -> None:
    fill(tmp_path, plan(), is_closed=is_closed)
    whole, path = tree(tmp_path), tmp_path / "gear/test/plan.json"
    for old, new in (("scene", "scenf"), ("billboard01", "billboard02"), ('"options"', '"optionz"'), ("{", "[")):
        path.write_bytes(whole["gear/test/plan.json"].replace(old.encode(), new.encode(), 1))
        with pytest.raises(DamagedError) as caught:
            Store(tmp_path, plan()).open({})
        remedy = "`gear verify DIR --repair`" if is_closed else "delete it and run the same collection again"
        assert remedy in str(caught.value) and "--force" not in str(caught.value)
    path.unlink()
    fill(tmp_path, plan(), is_closed=is_closed)
    assert tree(tmp_path) == whole


def test_a_plan_that_another_program_has_damaged_is_known_by_the_manifest(tmp_path: Path) -> None:
    fill(tmp_path, plan())
    path = tmp_path / "gear/test/plan.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"content": {"scenf": "billboard01", "seed": 5}}))
    with pytest.raises(DamagedError, match="the manifest is of another plan") as caught:
        Store(tmp_path, plan()).open({})
    assert "--force" not in str(caught.value)


@pytest.mark.parametrize(
    ("split", "samples", "said"),
    [("a|b", 3, r"'a\|b' is not a split's name"), ("test", 0, "must be at least 1, got 0")],
)
def test_a_plan_that_no_collection_has_is_refused(tmp_path: Path, split: str, samples: int, said: str) -> None:
    write_plan(tmp_path, plan(split, samples))
    with pytest.raises(DatasetError, match=said):
        read_plan(tmp_path, split)
