"""The installed engines: every other module of this folder is one, and is called by its name."""

from __future__ import annotations

import importlib
import pkgutil

from gear.contracts.executors import Executor
from gear.dataset import executors
from gear.values.errors import UnknownNameError

NO_ENGINES = ("engines", "in_process", "parts")
"""Modules of the room that are no engine."""

DEFAULT = "processes"


def engine_names() -> list[str]:
    """Names of the engines, sorted."""
    return sorted(one.name for one in pkgutil.iter_modules(executors.__path__) if one.name not in NO_ENGINES)


def open_engine(name: str, *, workers: int, backend: str, address: str | None = None) -> Executor:
    """An engine by its name.

    Args:
        name: of its module, which has a function `executor` with the other arguments.
        workers: how many items it may make at a time.
        backend: name of what may make a worker die or hang, for error messages.
        address: of a cluster, for engines that use one.

    Raises:
        UnknownNameError: there is no such engine.
        GearError: the engine cannot use the address, or a package that it needs is not installed.
    """
    known = engine_names()
    if name not in known:
        raise UnknownNameError("engine", name, known)
    module = importlib.import_module(f"{executors.__name__}.{name}")
    opened: Executor = module.executor(workers=workers, backend=backend, address=address)
    return opened
