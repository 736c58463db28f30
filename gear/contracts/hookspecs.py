"""The five hooks that a plugin implements. They take no arguments, have no effects and return specs.

gear's own tasks, models, attacks and defenses are registered through the same hooks.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pluggy

from gear.contracts.specs import AttackSpec, DefenseSpec, MetricSpec, ModelSpec, TaskSpec

PROJECT = "gear"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def gear_tasks() -> Iterable[TaskSpec[Any]]:
    """Tasks: each is a dataset format with its ground truth, its files and its metric."""
    return ()


@hookspec
def gear_models() -> Iterable[ModelSpec[Any]]:
    """Models: networks that do one or several tasks."""
    return ()


@hookspec
def gear_attacks() -> Iterable[AttackSpec[Any]]:
    """Attacks: algorithms that optimise patches against a model."""
    return ()


@hookspec
def gear_defenses() -> Iterable[DefenseSpec[Any]]:
    """Defenses: algorithms that clean pictures or detect patches in front of a model."""
    return ()


@hookspec
def gear_metrics() -> Iterable[MetricSpec[Any]]:
    """Metrics: further metrics for tasks of gear or of another package."""
    return ()
