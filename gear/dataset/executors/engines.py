"""Lists and opens the engines, which make the samples of a job; each engine is a module of this folder."""

from __future__ import annotations

import importlib
import pkgutil

from gear.contracts.executors import Executor, Needs
from gear.dataset import executors
from gear.dataset.executors.in_process import InThisProcess
from gear.values.errors import UnknownNameError

NO_ENGINES = ("calibrations", "engines", "in_process", "jobs", "parts", "threads")
"""Modules of the room that are no engine."""

DEFAULT = "processes"


def engine_names() -> list[str]:
    """The names of all engines (`processes`, `ray`, `slurm`), sorted."""
    return sorted(one.name for one in pkgutil.iter_modules(executors.__path__) if one.name not in NO_ENGINES)


def open_engine(
    name: str, *, workers: int, backend: str, address: str | None = None, needs: Needs | None = None
) -> Executor:
    """Opens an engine, which makes the samples of a job, by its name.

    Args:
        name: name of the engine, such as `processes`.
        workers: number of workers that make samples in parallel.
        backend: name of the renderer, for messages about workers that died or hang.
        address: address of a cluster, for engines that use a cluster; None otherwise.
        needs: what each worker needs; by default what workers need that make samples.

    Raises:
        UnknownNameError: there is no such engine.
        GearError: the engine cannot use the address, or a package that it needs is not installed.
    """
    known = engine_names()
    if name not in known:
        raise UnknownNameError("engine", name, known)
    module = importlib.import_module(f"{executors.__name__}.{name}")
    opened: Executor = module.executor(workers=workers, backend=backend, address=address, needs=needs or Needs())
    return opened


def open_executor(
    name: str, *, workers: int, backend: str, address: str | None = None, needs: Needs | None = None
) -> Executor:
    """Opens an engine as `open_engine` does, except that a single worker of the default engine is this process.

    Args:
        name: name of the engine, such as `processes`.
        workers: number of workers.
        backend: name of the renderer or of the command, for messages about workers that died or hang.
        address: address of the engine's cluster; None for the default.
        needs: what each worker needs; by default what workers need that make samples.

    Raises:
        UnknownNameError: there is no such engine.
        GearError: the engine cannot use the address, or a package that it needs is not installed.
    """
    if workers == 1 and name == DEFAULT and address is None:
        return InThisProcess()
    return open_engine(name, workers=workers, backend=backend, address=address, needs=needs)
