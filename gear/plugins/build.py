"""From a name and options to a product."""

from __future__ import annotations

from typing import Any

from gear.config.nodes import Mapping, Node, Place
from gear.config.reader import read_node
from gear.contracts.specs import Kind, TaskSpec
from gear.contracts.tasks import Task
from gear.plugins.catalogue import Found
from gear.plugins.manager import catalogue
from gear.values.errors import GearError, PluginError

NO_OPTIONS = Mapping({}, Place("defaults"))


def find(kind: Kind, name: str) -> Found:
    """The plugin that answers to a name."""
    return catalogue().get(kind, name)


def build(found: Found, options: Node = NO_OPTIONS) -> Any:
    """Makes a plugin's product from its options.

    Raises:
        ConfigError: the options do not fit.
        PluginError: a third party's `build` failed.
    """
    config = read_node(found.spec.config, options, "options")
    try:
        return found.spec.build(config)
    except GearError:
        raise
    except (Exception, SystemExit) as error:
        owner = found.owner
        raise PluginError(
            f"{found.spec.name} ({owner.package} {owner.version})", "build", f"{type(error).__name__}: {error}"
        ) from error


def build_task(name: str, options: Node = NO_OPTIONS) -> tuple[TaskSpec[Any], Task[Any, Any]]:
    """A task and its spec."""
    found = find("task", name)
    assert isinstance(found.spec, TaskSpec)
    return found.spec, build(found, options)
