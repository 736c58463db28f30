"""Discovery of plugins. An error in a plugin is reported with the plugin's name; other plugins are loaded."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import importlib.metadata
import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from itertools import islice
from pathlib import Path
from types import FrameType
from typing import Any

import pluggy

from gear.contracts import hookspecs
from gear.plugins.builtins import BUILTINS
from gear.plugins.catalogue import Broken, Catalogue, Owner, PluginEntry, as_iterable
from gear.plugins.probe import unsafe_plugins
from gear.plugins.spec_validation import HOOK_OF, spec_problem
from gear.plugins.text import one_line, printable
from gear.values.entry_points import identity, installed_entry_points

DISTRIBUTION = "mujoco-gear"
GROUP = "gear"
"""Name of the entry-point group in which packages register their gear plugins."""

MOST_SPECS = 1000
"""Largest number of specs per hook; a hook that returns more is considered an endless generator."""


@cache
def catalogue() -> Catalogue:
    """All plugins of this Python environment, discovered once per process.

    The variable `GEAR_DISABLE_PLUGINS` (names joined by commas, or `*` for all) disables plugins of other packages. A
    plugin that is new on this machine is first loaded in a separate process (`gear.plugins.probe`). A plugin that ends
    or blocks that process, or raises KeyboardInterrupt in it, is not loaded into this process.
    """
    entry_points, damaged = installed_entry_points(GROUP)
    allowed = _allowed(entry_points, os.environ.get("GEAR_DISABLE_PLUGINS", ""))
    unsafe = unsafe_plugins(allowed)
    found = discover([one for one in allowed if one not in unsafe])
    broken = [
        Broken(owner=_owner(one.name, one.name, one.version), stage="entry_points.txt", problem=one_line(one.error))
        for one in damaged
    ]
    broken += [Broken(owner=owner_of(one), stage=stage, problem=problem) for one, (stage, problem) in unsafe.items()]
    return Catalogue(found.found, (*broken, *found.broken))


def discover(entry_points: Iterable[importlib.metadata.EntryPoint], disabled: str = "") -> Catalogue:
    """Loads the built-in plugins and the plugins of some entry points into this process.

    Args:
        entry_points: entry points of other packages.
        disabled: names of entry points to leave out, joined by commas; `*` for all.

    Raises:
        Exception: a built-in plugin is broken, which is a bug of gear and keeps its traceback.
        KeyboardInterrupt: the user pressed Ctrl-C. A KeyboardInterrupt that a plugin raises is reported like any other
            exception.
    """
    manager = pluggy.PluginManager(hookspecs.PROJECT)
    manager.add_hookspecs(hookspecs)
    owners: dict[str, Owner] = {}
    broken: list[Broken] = []
    own = Owner(plugin="", package=DISTRIBUTION, version=_version(DISTRIBUTION))
    for module in BUILTINS:
        manager.register(importlib.import_module(module), name=module)
        owners[module] = dataclasses.replace(own, plugin=module)
    for entry_point in sorted(_allowed(entry_points, disabled), key=lambda e: (e.name, e.value)):
        owner = owner_of(entry_point)
        name = f"{owner.package}:{entry_point.name}"
        failure = _register(manager, entry_point, name)
        if failure is None:
            owners[name] = owner
        else:
            broken.append(Broken(owner=owner, stage=failure[0], problem=failure[1]))
    found, failed = _call_hooks(manager, owners)
    return Catalogue(tuple(found), (*broken, *failed))


def owner_of(entry_point: importlib.metadata.EntryPoint) -> Owner:
    """Returns the package (distribution) of an entry point; if it is unknown, the name of the entry point's module
    and the version `?`.

    Args:
        entry_point: the entry point by which a package registers a plugin.
    """
    package, version = entry_point.value.split(":")[0], "?"
    if entry_point.dist is not None:
        package, version = identity(entry_point.dist)
    return _owner(entry_point.name, package, version)


def _owner(plugin: str, package: str, version: str) -> Owner:
    return Owner(plugin=printable(plugin), package=printable(package), version=printable(version))


def _allowed(
    entry_points: Iterable[importlib.metadata.EntryPoint], disabled: str
) -> list[importlib.metadata.EntryPoint]:
    off = {name.strip() for name in disabled.split(",")}
    return [one for one in entry_points if one.name not in off and "*" not in off]


def _register(
    manager: pluggy.PluginManager, entry_point: importlib.metadata.EntryPoint, name: str
) -> tuple[str, str] | None:
    """Imports a plugin and registers its hooks.

    Returns:
        None on success; otherwise stage and problem, and no hook of the plugin stays registered.
    """
    stage = "import"
    try:
        plugin = guarded(entry_point.load)
        stage = "register"
        guarded(partial(manager.register, plugin, name=name))
        manager.check_pending()  # a misspelt hook name is an error, not a no-op
    except PluginRaisedError as raised:
        problem = raised.problem
    except pluggy.PluginValidationError as error:
        problem = one_line(error)
    else:
        return None
    if manager.has_plugin(name):
        manager.unregister(name=name)
    return stage, problem


def _call_hooks(manager: pluggy.PluginManager, owners: dict[str, Owner]) -> tuple[list[PluginEntry], list[Broken]]:
    """Calls each implementation of a hook separately, so that an exception does not affect the others and its owner is
    known.
    """
    found: list[PluginEntry] = []
    broken: list[Broken] = []
    for kind, hook in HOOK_OF.items():
        for implementation in getattr(manager.hook, hook).get_hookimpls():
            owner = owners[implementation.plugin_name]
            try:
                specs = guarded(partial(_specs_of, implementation.function))
                problems = [guarded(partial(spec_problem, kind, spec)) for spec in specs]
            except PluginRaisedError as raised:
                if owner.package == DISTRIBUTION:
                    raise raised.error from None
                broken.append(Broken(owner=owner, stage=f"hook {hook}", problem=raised.problem))
                continue
            for spec, problem in zip(specs, problems, strict=True):
                if problem is None:
                    found.append(PluginEntry(kind=kind, spec=spec, owner=owner))
                else:
                    broken.append(Broken(owner=owner, stage="spec", problem=problem))
    return found, broken


def _specs_of(hook: Callable[[], Any]) -> list[Any]:
    """The specs that a plugin's hook returns, as a list.

    Raises:
        TypeError: the hook returned something else than a collection of specs.
        ValueError: the hook returned too many specs.
    """
    specs = list(islice(as_iterable(hook()), MOST_SPECS + 1))
    if len(specs) > MOST_SPECS:
        raise ValueError(f"returns more than {MOST_SPECS} specs")
    return specs


class PluginRaisedError(Exception):
    """An exception that wraps whatever a plugin's code raised.

    Attributes:
        error: the raised exception, which need not be an `Exception`.
        problem: the exception as one printable line.

    Args:
        error: the raised exception.
    """

    def __init__(self, error: BaseException) -> None:
        self.problem = one_line(error)
        super().__init__(self.problem)
        self.error = error


def guarded(call: Callable[[], Any]) -> Any:
    """Runs a plugin's code, discards what it prints to stdout, and returns its result.

    Args:
        call: the code to run, without arguments.

    Raises:
        PluginRaisedError: the code raised any exception, including SystemExit, GeneratorExit and KeyboardInterrupt.
        KeyboardInterrupt: the user pressed Ctrl-C meanwhile.
    """
    with _noticing_interrupts() as interrupts, _restored_process():
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                return call()
        except BaseException as error:
            if interrupts:
                raise KeyboardInterrupt from None
            raise PluginRaisedError(error) from error


@contextlib.contextmanager
def _restored_process() -> Iterator[None]:
    """A context at whose end the working folder and `sys.stderr` are those of its beginning."""
    folder, stderr = _working_folder(), sys.stderr
    try:
        yield
    finally:
        sys.stderr = stderr
        if folder is not None and _working_folder() != folder:
            with contextlib.suppress(OSError):
                os.chdir(folder)


def _working_folder() -> Path | None:
    """The working folder; None if it was deleted."""
    try:
        return Path.cwd()
    except OSError:
        return None


@contextlib.contextmanager
def _noticing_interrupts() -> Iterator[list[int]]:
    """A list that gets an entry when the user presses Ctrl-C, to distinguish it from a KeyboardInterrupt that the
    plugin raises.

    Signals can be handled only in the main thread, and only Python's default handler is replaced. Otherwise every
    KeyboardInterrupt is attributed to the plugin.
    """
    seen: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        raise KeyboardInterrupt

    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield seen
        return
    signal.signal(signal.SIGINT, interrupt)
    try:
        yield seen
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "source"
