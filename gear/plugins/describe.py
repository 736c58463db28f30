"""Descriptions of plugins for command output and documentation: capabilities, options, source file."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from typing import Any

from gear.config.dump import to_plain
from gear.contracts.specs import AnySpec, ModelSpec, Spec
from gear.plugins.catalogue import PluginEntry
from gear.plugins.text import printable

COMMON = {field.name for field in dataclasses.fields(Spec)}
ELSEWHERE = {"recipe", "published", "convert", "parameters", "starts", "notes"}
"""Fields of specs that `summary` leaves out, because `training`, `gear models` and `gear collect` show them."""

LONGEST_MEANING = 2000
"""Largest length of an option's description in characters."""

UNITS = {
    "px": "pixels", "m": "metres", "mm": "millimetres", "deg": "degrees", "rad": "radians", "s": "seconds",
    "levels": "levels of 0..255", "unit": "of 0..1", "hz": "hertz", "kmh": "km/h", "mps": "m/s", "mb": "megabytes",
}  # fmt: skip
"""Units by the last word of an option's name."""


def summary(plugin: PluginEntry) -> dict[str, Any]:
    """Describes a plugin as a JSON object: `kind`, `name`, `package`, `version`, `summary` and `capabilities`.

    The capabilities are the spec's further fields, without those that `training` and other commands show.

    Args:
        plugin: the plugin, from the catalogue.
    """
    capabilities = {
        field.name: sorted(value) if isinstance(value := getattr(plugin.spec, field.name), frozenset) else value
        for field in dataclasses.fields(plugin.spec)
        if field.name not in COMMON | ELSEWHERE
    }
    return {
        "kind": plugin.kind,
        "name": plugin.spec.name,
        "package": plugin.owner.package,
        "version": plugin.owner.version,
        "summary": plugin.spec.summary,
        "capabilities": capabilities,
    }


def training(spec: AnySpec) -> dict[str, Any]:
    """Describes how a network is trained, as a JSON object: `recipe` (null if gear cannot train it) and `starts`.

    `starts` are the names that `gear train --init` accepts in addition to `shipped` and files. The result is empty for
    plugins that are not models.

    Args:
        spec: the plugin's description.
    """
    if not isinstance(spec, ModelSpec):
        return {}
    return {"recipe": to_plain(spec.recipe), "starts": sorted(spec.starts)}


def options(config: type[Any]) -> list[dict[str, Any]]:
    """Describes every option of a plugin as a JSON object with `name`, `type`, `default`, `meaning` and `unit`.

    Args:
        config: the dataclass of the plugin's options; options inside a nested dataclass get names with dots.
    """
    return _options(config(), "")


def _options(defaults: Any, prefix: str) -> list[dict[str, Any]]:
    config = type(defaults)
    meanings = meanings_of(config)
    result: list[dict[str, Any]] = []
    for field in dataclasses.fields(config):
        default, name = getattr(defaults, field.name), f"{prefix}{field.name}"
        if dataclasses.is_dataclass(default) and not isinstance(default, type):
            result += _options(default, f"{name}.")
            continue
        kind = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
        unit = UNITS.get(field.name.rsplit("_", 1)[-1], "") if "_" in field.name else ""
        result.append(
            {
                "name": name,
                "type": kind,
                "default": to_plain(default),
                "meaning": printable(meanings.get(field.name, ""), LONGEST_MEANING),
                "unit": unit,
            }
        )
    return result


def meanings_of(config: type[Any]) -> dict[str, str]:
    """Returns the descriptions of a config's fields, one line each, by name of the field.

    They stand below `Attributes:` in the docstrings of the class and its base classes.

    Args:
        config: the dataclass of the options.
    """
    result: dict[str, str] = {}
    for owner in reversed(config.__mro__):
        _, found, section = inspect.cleandoc(owner.__dict__.get("__doc__") or "").partition("Attributes:\n")
        if not found:
            continue
        names: list[str] = []
        for line in section.splitlines():
            if line and not line.startswith(" "):
                break
            entry = re.match(r" {4}(\w+(?:, \w+)*): (.*)", line)
            if entry:
                names = entry[1].split(", ")
                result.update(dict.fromkeys(names, entry[2].strip()))
            elif line.strip():
                result.update({name: f"{result[name]} {line.strip()}" for name in names})
    return result


def source_of(spec: AnySpec) -> str:
    """Returns the path of the source file that defines the plugin's `build`; "" if Python does not know it.

    Args:
        spec: the plugin's description.
    """
    try:
        return inspect.getsourcefile(spec.build) or ""
    except TypeError:
        module = sys.modules.get(getattr(spec.config, "__module__", ""))
        return getattr(module, "__file__", None) or ""
