"""What a record's config must hold so that it can be measured again."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.verbs.bench.plan import Plan
from gear.verbs.leaderboard import rerun
from gear.verbs.leaderboard.rerun import check_data, moved_patches, only_evaluation, refuse_enormous
from tests.leaderboard.conftest import SAMPLES, record


def test_calibrations_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(rerun, "guard_of", lambda *given: SimpleNamespace(calibration=None))
    monkeypatch.setattr(rerun, "open_guard", lambda *given, callbacks: asked.append(callbacks))
    monkeypatch.setattr(rerun, "GuardedModel", lambda *given, **named: "guarded")
    shown = Callbacks.of()
    planned = SimpleNamespace(model=SimpleNamespace(chosen=None), task_plugins=SimpleNamespace(name="semseg"))
    config = SimpleNamespace(seed=0)
    one = SimpleNamespace(planned=planned, plan=SimpleNamespace(config=config), _guarded={}, _callbacks=shown)
    assert rerun.Rerun.guarded(cast(rerun.Rerun, one)) == "guarded"
    assert asked == [shown]


def plan(tasks: int, defenses: list[str | None]) -> Plan:
    """A plan of some tasks with one evaluation for each defense; None is a network alone."""
    every: list[Any] = [SimpleNamespace(defense=one) for one in defenses]
    return cast(Plan, SimpleNamespace(plugins_of_tasks=["task"] * tasks, planned_evaluations=lambda _: every))


def test_the_evaluation_of_a_record_is_found() -> None:
    assert only_evaluation(plan(1, [None, "guard"]), guarded=True).defense is not None
    assert only_evaluation(plan(1, [None, "guard"]), guarded=False).defense is None


@pytest.mark.parametrize(
    ("tasks", "defenses", "problem"),
    [
        (2, [None], "has 2 tasks; a record is about one"),
        (0, [], "has 0 tasks"),
        (1, [None], "names 0 times a network behind a defense"),
        (1, [None, "one", "other"], "names 2 times a network behind a defense"),
    ],
)
def test_another_number_of_tasks_or_defenses_is_one_line(tasks: int, defenses: list[str | None], problem: str) -> None:
    with pytest.raises(GearError, match=problem):
        only_evaluation(plan(tasks, defenses), guarded=True)


def test_a_record_has_the_data_that_its_config_makes() -> None:
    check_data(record(), places=1, samples=SAMPLES)
    with pytest.raises(GearError, match="makes 2 datasets of 4 samples with none, the record has 1 of 4 samples"):
        check_data(record(), places=2, samples=SAMPLES)
    with pytest.raises(GearError, match="makes 1 datasets of 3 samples"):
        check_data(record(), places=1, samples=3)


def test_patches_of_the_first_scene_are_shown_elsewhere() -> None:
    one = record()
    alone = replace(one, patches=(replace(one.patches[0], target="net"), *one.patches))
    moved = moved_patches(alone, "net", ["here", "there"])
    assert [(each.scene, each.target) for each in moved] == [
        ("here", "net"), ("here", "net+guard"), ("there", "net"), ("there", "net+guard"),
    ]  # fmt: skip
    with pytest.raises(GearError, match="names no patches of net"):
        moved_patches(one, "net", ["here"])


def test_enormous_pictures_are_refused() -> None:
    refuse_enormous({"collect": {"options": {"width_px": 256, "height_px": "tall"}}})
    with pytest.raises(GearError, match="at most 8192"):
        refuse_enormous({"collect": {"options": {"width_px": 10**8}}})
