"""The four hooks. They take nothing, change nothing and return specs; built-ins come in by the same ones."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pluggy

from gear.contracts.specs import AttackSpec, DefenseSpec, ModelSpec, TaskSpec

PROJECT = "gear"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


@hookspec
def gear_tasks() -> Iterable[TaskSpec[Any]]:
    """Tasks: dataset formats with their ground truth."""
    return ()


@hookspec
def gear_models() -> Iterable[ModelSpec[Any]]:
    """Models: networks."""
    return ()


@hookspec
def gear_attacks() -> Iterable[AttackSpec[Any]]:
    """Attacks: what makes patches."""
    return ()


@hookspec
def gear_defenses() -> Iterable[DefenseSpec[Any]]:
    """Defenses: what guards a model."""
    return ()
