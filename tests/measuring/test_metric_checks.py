"""Metrics that evaluators return are checked."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gear.measuring.metric_checks import checked_metrics
from gear.values.errors import PluginError

PLAN: Any = SimpleNamespace(task={"package": "mujoco-gear", "name": "depth"})


def test_numbers_by_name_pass() -> None:
    assert checked_metrics(PLAN, {"rmse_m": 1}, "result") == {"rmse_m": 1}


@pytest.mark.parametrize("returned", [None, 3.0, {"rmse_m": "1"}, {1: 1.0}])
def test_anything_else_names_the_task(returned: Any) -> None:
    with pytest.raises(PluginError, match="depth") as caught:
        checked_metrics(PLAN, returned, "result")
    assert "its evaluator" in str(caught.value)
