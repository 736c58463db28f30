"""States in the names of curves and figures which direction is better."""

from __future__ import annotations

from typing import Any

from gear.contracts.evaluation import Directed, Reports
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Task

UP, DOWN = "up is better", "down is better"

FOR_THE_ATTACK = "for the attack"
"""Addition to the direction of an attack's metrics; an attack succeeds where the network fails."""


def with_direction(name: str, *, lower_is_better: bool | None, whose: str = "") -> str:
    """Returns the name of a curve with its direction in brackets, such as `loss (down is better)`.

    Args:
        name: name of the curve.
        lower_is_better: whether lower values are better; None leaves the name as it is, for curves without a better
            direction, such as a learning rate.
        whose: addition that names the side for which the direction is better, such as `for the attack`; "" for none.
    """
    if lower_is_better is None:
        return name
    return f"{name} ({' '.join(filter(None, (DOWN if lower_is_better else UP, whose)))})"


def metric_direction(name: str, spec: TaskSpec[Any], task: Task[Any, Any]) -> bool | None:
    """Whether lower values of a task's metric are better; None if no direction is better, or if none is stated.

    An evaluator of another package that fails, or returns something else, states no direction: a name of a curve must
    not end a training.

    Args:
        name: name of the metric; `<report>.<metric>` for a metric of a report.
        spec: spec of the task, which states the direction of its main metric.
        task: the task, whose evaluators state the directions of all metrics if they implement `Directed`.
    """
    if name == spec.metric:
        return spec.lower_is_better
    evaluators = task.reports() if isinstance(task, Reports) else {}
    report, _, metric = name.partition(".")
    evaluator, known = (evaluators[report], metric) if report in evaluators else (task.evaluator(), name)
    try:
        stated = evaluator.lower_is_better(known) if isinstance(evaluator, Directed) else None
    except Exception:  # an evaluator of another package
        return None
    return stated if isinstance(stated, bool) else None
