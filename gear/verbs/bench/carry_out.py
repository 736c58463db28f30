"""Carries out single steps of a benchmark."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gear.dataset.guarded_paths import remove_tree
from gear.values.errors import GearError, OutdatedError, ReplaceableError
from gear.values.progress import Callbacks, Warn
from gear.verbs.attack.run import attack
from gear.verbs.bench.plan import Step, Verb
from gear.verbs.collect.run import collect
from gear.verbs.drive.run import drive
from gear.verbs.evaluate.run import CalibrationChangedError, evaluate

VERBS: dict[Verb, Callable[..., Any]] = {"collect": collect, "attack": attack, "evaluate": evaluate, "drive": drive}


def carry_out(step: Step, root: Path, callbacks: Callbacks, *, changed: Mapping[str, Any] | None = None) -> Any:
    """Carries out one step of a benchmark, and returns the result of its verb.

    Args:
        step: the step.
        root: folder of the benchmark.
        callbacks: callbacks that receive progress and warnings.
        changed: arguments of the verb that replace those of the step, such as `workers`.

    Raises:
        GearError: the step fails; the message names the step.
    """
    keywords: dict[str, Any] = {"on_progress": callbacks.on_progress, "on_warning": callbacks.on_warning}
    if step.verb != "collect":
        keywords["on_fit_progress"] = callbacks.on_fit_progress
        keywords["on_fit_phase"] = callbacks.on_fit_phase
    try:
        return _result(step, root, {**step.arguments, **(changed or {}), **keywords}, callbacks.on_warning)
    except ReplaceableError as error:
        raise GearError(f"{step.title}: {error.path}: {error.problem}; use another --out, or remove it") from error
    except GearError as error:
        raise GearError(f"{step.title}: {error}") from error


def _result(step: Step, root: Path, arguments: Mapping[str, Any], on_warning: Warn) -> Any:
    """Calls the verb of a step. Results of pictures or patches that have changed since are replaced."""
    verb, again = VERBS[step.verb], f"{step.title}: is made again, for what is there"
    try:
        return verb(**arguments)
    except OutdatedError as error:
        on_warning(f"{again} {error.problem}")
        return verb(**arguments, force=True)
    except CalibrationChangedError as error:
        on_warning(f"{again} {error.problem.partition(';')[0]}")
        remove_tree(root, Path(error.path).relative_to(root).as_posix())
        return verb(**arguments)
