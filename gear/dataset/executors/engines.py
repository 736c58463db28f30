"""The installed engines: every other module of this folder is one, and is called by its name."""

from __future__ import annotations

import importlib
import pkgutil

from gear.dataset import executors
from gear.dataset.executors.executor import Executor
from gear.values.errors import UnknownNameError

NO_ENGINES = ("executor", "engines")
"""Modules of the room that are no engine."""

DEFAULT = "processes"


def engine_names() -> list[str]:
    """Names of the engines, sorted."""
    return sorted(one.name for one in pkgutil.iter_modules(executors.__path__) if one.name not in NO_ENGINES)


def open_engine(name: str, *, workers: int, backend: str) -> Executor:
    """An engine by its name.

    Args:
        name: of its module, which has a function `executor` with the two other arguments.
        workers: how many items it may make at a time.
        backend: name of what may make a worker die or hang, for error messages.

    Raises:
        UnknownNameError: there is no such engine.
    """
    known = engine_names()
    if name not in known:
        raise UnknownNameError("engine", name, known)
    module = importlib.import_module(f"{executors.__name__}.{name}")
    opened: Executor = module.executor(workers=workers, backend=backend)
    return opened
