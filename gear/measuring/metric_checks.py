"""Checks that the evaluator of a task returns metrics as names and numbers."""

from __future__ import annotations

from typing import Any

from gear.dataset.checks.output_checks import check_metrics
from gear.dataset.plan import Plan
from gear.measuring.guarded_model import plugin_error
from gear.plugins.build import find, name_of_task


def checked_metrics(plan: Plan, returned: Any, method: str) -> dict[str, float]:
    """Checks the metrics that an evaluator of the dataset's task returned, and returns them by name.

    Args:
        plan: plan of the dataset.
        returned: value that the evaluator returned.
        method: method of the evaluator, for the error message.

    Raises:
        PluginError: the value is not a mapping of names to numbers; the error names the task's plugin.
    """
    try:
        return check_metrics(returned, method)
    except TypeError as error:
        raise plugin_error(find("task", name_of_task(plan.task)), "its evaluator", str(error)) from error
