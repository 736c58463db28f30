"""Builds plugins from their names and options, and makes errors of a plugin's code name the plugin."""

from __future__ import annotations

import contextlib
import sys
import traceback
from collections.abc import Iterable, Iterator
from collections.abc import Mapping as JsonMapping
from typing import Any

from gear.config.nodes import Mapping, Node, Place
from gear.config.reader import read_node
from gear.contracts.specs import Kind, TaskSpec
from gear.contracts.tasks import Task
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import DISTRIBUTION, catalogue
from gear.plugins.text import one_line
from gear.values.errors import GearError, PluginError

NO_OPTIONS = Mapping({}, Place("defaults"))


def find(kind: Kind, name: str) -> PluginEntry:
    """Finds a plugin by its kind and name in this environment's catalogue.

    Args:
        kind: kind of plugin, such as `model` or `attack`.
        name: name of the plugin, or `package/name`.

    Raises:
        UnknownNameError: there is no such plugin.
        DuplicateNameError: several packages have a plugin of this name.
    """
    return catalogue().get(kind, name)


def plugins_of_kind(kind: Kind) -> tuple[PluginEntry, ...]:
    """Returns all plugins of a kind in this environment, sorted by name.

    Args:
        kind: kind of plugin, such as `model` or `attack`.
    """
    return catalogue().of_kind(kind)


def broken_hint() -> str:
    """A text in brackets that names the plugins that failed to load, for messages about unknown names; "" for none."""
    return catalogue().broken_hint()


def name_of_task(written: JsonMapping[str, Any]) -> str:
    """The name by which the catalogue finds the task with which a dataset was written.

    Args:
        written: the entry on the task in the dataset's plan (its stored configuration), with `name` and `package`.

    Returns:
        `package/name` if that package is installed, since another package may have a task of the same name; otherwise
        `name`.
    """
    full = f"{written.get('package')}/{written['name']}"
    return full if any(found.full_name == full for found in catalogue().of_kind("task")) else written["name"]


def build(plugin: PluginEntry, options: Node = NO_OPTIONS) -> Any:
    """Builds a plugin's product (a task, model, attack, defense, controller, metric or logger) from its options.

    Args:
        plugin: the plugin, from `find`.
        options: the options as read from a config or the command line; options that are left out have their defaults.

    Raises:
        ConfigError: the options do not fit.
        PluginError: the `build` function of another package failed.
    """
    config = read_node(plugin.spec.config, options, "options")
    with blamed(plugin, "build"):
        return plugin.spec.build(config)


@contextlib.contextmanager
def blamed(plugin: PluginEntry, stage: str) -> Iterator[None]:
    """A context for running a plugin's code: exceptions get the plugin's name, and output to stdout goes to
    stderr.

    Args:
        plugin: the plugin whose code runs.
        stage: what the code does, for the message, such as `build`.

    Raises:
        PluginError: code of another package raised something other than a `GearError`. Exceptions of built-in plugins
            are bugs of gear and keep their traceback.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except (GearError, KeyboardInterrupt):
        raise
    except BaseException as error:  # SystemExit, GeneratorExit and those of the plugin's own making, too
        owner = plugin.owner
        if owner.package == DISTRIBUTION:
            raise
        name = f"{plugin.spec.name} ({owner.package} {owner.version})"
        raise PluginError(name, stage, one_line(error)) from error


@contextlib.contextmanager
def traced(founds: Iterable[PluginEntry], stage: str) -> Iterator[None]:
    """A context for code that calls plugins, such as an attack that calls a network of another package.

    An exception that passed through the code of such a package gets the plugin's name.

    Args:
        founds: plugins whose code may be called.
        stage: what the code does, for the message, such as `optimise`.

    Raises:
        PluginError: code of one of the packages, or code that it called, raised something other than a `GearError`.
    """
    try:
        yield
    except GearError:
        raise
    except Exception as error:
        passed = {str(frame.f_globals.get("__name__")) for frame, _ in traceback.walk_tb(error.__traceback__)}
        packages = {name.partition(".")[0] for name in passed}
        for found in founds:
            is_ours = found.owner.package == DISTRIBUTION
            if not is_ours and str(getattr(found.spec.build, "__module__", "")).partition(".")[0] in packages:
                name = f"{found.spec.name} ({found.owner.package} {found.owner.version})"
                raise PluginError(name, stage, one_line(error)) from error
        raise


def build_task(name: str, options: Node = NO_OPTIONS) -> tuple[TaskSpec[Any], Task[Any, Any]]:
    """Builds a task from its options, and returns the plugin's description (spec) and the task.

    Args:
        name: name of the task's plugin, or `package/name`.
        options: the task's options; options that are left out have their defaults.
    """
    found = find("task", name)
    assert isinstance(found.spec, TaskSpec)
    return found.spec, build(found, options)
