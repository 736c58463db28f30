"""Names of curves with the direction that is better."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gear.contracts.evaluation import Directed, Reports
from gear.plugins.manager import catalogue
from gear.reporting.directions import FOR_THE_ATTACK, metric_direction, with_direction


def test_a_name_states_its_direction() -> None:
    assert with_direction("miou", lower_is_better=False) == "miou (up is better)"
    assert with_direction("loss", lower_is_better=True) == "loss (down is better)"
    assert with_direction("miss", lower_is_better=False, whose=FOR_THE_ATTACK) == ("miss (up is better for the attack)")
    assert with_direction("learning rate", lower_is_better=None, whose=FOR_THE_ATTACK) == "learning rate"


@pytest.mark.parametrize("name", catalogue().names("task"))
def test_all_evaluators_of_installed_tasks_state_directions(name: str) -> None:
    spec: Any = catalogue().get("task", name).spec
    task = spec.build(spec.config())
    reports = task.reports() if isinstance(task, Reports) else {}
    assert all(isinstance(one, Directed) for one in (task.evaluator(), *reports.values()))
    assert metric_direction(spec.metric, spec, task) is spec.lower_is_better


def test_a_direction_is_found_in_the_evaluator_of_the_report() -> None:
    spec: Any = catalogue().get("task", "semseg").spec
    task = spec.build(spec.config())
    assert metric_direction("iou_road", spec, task) is False
    assert metric_direction("critical.as_road_share", spec, task) is True
    spec = catalogue().get("task", "detect2d").spec
    assert metric_direction("reference.instances_car", spec, spec.build(spec.config())) is None


def test_without_statements_the_main_metric_alone_has_a_direction() -> None:
    spec: Any = SimpleNamespace(metric="error", lower_is_better=True)
    task: Any = SimpleNamespace(evaluator=SimpleNamespace)
    assert metric_direction("error", spec, task) is True
    assert metric_direction("other.share", spec, task) is None


@pytest.mark.parametrize("answer", [lambda metric: 1 / 0, lambda metric: "up", lambda: True])
def test_an_evaluator_that_fails_states_no_direction(answer: Any) -> None:
    spec: Any = SimpleNamespace(metric="error", lower_is_better=True)
    task: Any = SimpleNamespace(evaluator=lambda: SimpleNamespace(lower_is_better=answer))
    assert metric_direction("other", spec, task) is None
