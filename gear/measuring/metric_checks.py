"""What a task's evaluators say, held to their contract before anybody reckons with it."""

from __future__ import annotations

from typing import Any

from gear.dataset.output_checks import check_metrics
from gear.dataset.plan import Plan
from gear.measuring.guarded_model import accusation
from gear.plugins.build import find, name_of_task


def said_of(plan: Plan, given: Any, method: str) -> dict[str, float]:
    """Metrics that `method` of an evaluator gave, by name; `plan` is of the dataset that it was asked about.

    Raises:
        PluginError: they are no mapping of names to numbers; says whose task it is.
    """
    try:
        return check_metrics(given, method)
    except TypeError as error:
        raise accusation(find("task", name_of_task(plan.task)), "its evaluator", str(error)) from error
