"""The seven hooks that a plugin implements. They take no arguments, have no effects and return specs.

gear's own tasks, models, attacks, defenses, controllers and loggers are registered through the same hooks.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pluggy

from gear.contracts.specs import AttackSpec, ControllerSpec, DefenseSpec, LoggerSpec, MetricSpec, ModelSpec, TaskSpec

PROJECT = "gear"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def gear_tasks() -> Iterable[TaskSpec[Any]]:
    """Hook that returns the specs of a plugin's tasks. A task is a dataset format with its ground truth, its files
    and its metric.
    """
    return ()


@hookspec
def gear_models() -> Iterable[ModelSpec[Any]]:
    """Hook that returns the specs of a plugin's models. A model is a network that performs one or several tasks."""
    return ()


@hookspec
def gear_attacks() -> Iterable[AttackSpec[Any]]:
    """Hook that returns the specs of a plugin's attacks. An attack is an algorithm that optimises patches against
    a model.
    """
    return ()


@hookspec
def gear_defenses() -> Iterable[DefenseSpec[Any]]:
    """Hook that returns the specs of a plugin's defenses. A defense cleans pictures or detects patches in front of
    a model.
    """
    return ()


@hookspec
def gear_controllers() -> Iterable[ControllerSpec[Any]]:
    """Hook that returns the specs of a plugin's controllers. A controller drives the ego car in `gear drive`."""
    return ()


@hookspec
def gear_metrics() -> Iterable[MetricSpec[Any]]:
    """Hook that returns the specs of a plugin's metrics for existing tasks, of gear or of another package."""
    return ()


@hookspec
def gear_loggers() -> Iterable[LoggerSpec[Any]]:
    """Hook that returns the specs of a plugin's loggers. A logger shows the curves and figures of a run in a tool such
    as TensorBoard.
    """
    return ()
