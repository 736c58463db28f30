"""Checks every field of a plugin's spec (its description for gear) against the type hints of the spec class."""

from __future__ import annotations

import collections.abc
import dataclasses
import re
import types
import typing
from collections.abc import Mapping
from functools import cache
from typing import Any, Literal, TypeVar

from gear.contracts.specs import PROTOCOL_VERSION, SPEC_TYPES, Kind, MetricSpec, Spec
from gear.plugins.text import one_line, printable, type_name

HOOK_OF: dict[Kind, str] = {
    "task": "gear_tasks",
    "model": "gear_models",
    "attack": "gear_attacks",
    "defense": "gear_defenses",
    "controller": "gear_controllers",
    "metric": "gear_metrics",
    "logger": "gear_loggers",
}
"""Names of the hooks that return specs, by kind of plugin."""

NAME = re.compile(r"[a-z][a-z0-9_]*")
COMMON_FIELDS = frozenset(field.name for field in dataclasses.fields(Spec))
"""Fields that every spec has; they are checked separately."""


def spec_problem(kind: Kind, spec: Any) -> str | None:
    """Returns the first reason why a plugin's spec (its description for gear) cannot be used, in one line; None
    for a valid spec. Never raises.

    Args:
        kind: kind of plugin, which determines the class that the spec must have.
        spec: whatever the plugin's hook returned.
    """
    try:
        return _spec_problem(kind, spec)
    except Exception as error:
        return f"its {SPEC_TYPES[kind].__name__} cannot be read: {one_line(error)}"


def _spec_problem(kind: Kind, spec: Any) -> str | None:
    expected = SPEC_TYPES[kind]
    if not isinstance(spec, expected):
        return f"{HOOK_OF[kind]} returns {expected.__name__} objects, got {type_name(spec)}"
    if type(spec.name) is not str or not NAME.fullmatch(spec.name):
        return f"{printable(repr(spec.name))} is not a plugin's name (lower case letters, digits, _)"
    if spec.protocol != PROTOCOL_VERSION:
        return f"{spec.name!r} speaks protocol {spec.protocol}, this gear speaks {PROTOCOL_VERSION}; update one of them"
    problem = _common_problem(spec) or _field_problem(kind, spec) or _default_problem(spec)
    if problem is None and isinstance(spec, MetricSpec) and not spec.tasks:
        problem = "its tasks are empty; name the tasks that it measures"
    return None if problem is None else f"{spec.name!r}: {problem}"


def _common_problem(spec: Spec[Any, Any]) -> str | None:
    """The problem with a spec's summary, config class or build, for which type hints are not enough; None for none."""
    summary, config, build = (getattr(spec, name) for name in ("summary", "config", "build"))
    if not isinstance(summary, str) or not summary.strip() or not summary.isprintable():
        return "its summary is not one line"
    if not (dataclasses.is_dataclass(config) and isinstance(config, type)):
        return "its config is not a dataclass"
    missing = dataclasses.MISSING
    if any(field.default is missing and field.default_factory is missing for field in dataclasses.fields(config)):
        return "every option needs a default"
    return None if callable(build) else "its build cannot be called"


def _field_problem(kind: Kind, spec: Any) -> str | None:
    """The first problem with a spec's fields beyond the common ones, by their type hints; None for none."""
    for name, hint in _hints(kind).items():
        problem = mismatch(getattr(spec, name), hint, name)
        if problem is not None:
            return f"its {problem}"
    return None


def _default_problem(spec: Spec[Any, Any]) -> str | None:
    try:
        spec.config()
    except Exception as error:
        return f"its own defaults are refused: {one_line(error)}"
    return None


@cache
def _hints(kind: Kind) -> dict[str, Any]:
    """The type hints of a spec class by field, without the fields that every spec has."""
    hints = typing.get_type_hints(SPEC_TYPES[kind])
    return {name: hint for name, hint in hints.items() if name not in COMMON_FIELDS}


def mismatch(value: Any, hint: Any, name: str) -> str | None:
    """Describes how a value differs from a type hint, as `<name> must be <what>, got <type>`; None if it fits.

    Supports classes, `Literal`, unions, callables, mappings, `tuple`, `frozenset` and nested dataclasses, whose fields
    are checked too. A float may be an integer; a number must not be a bool; a text must be printable, because it is
    shown in terminals.

    Args:
        value: value of the field.
        hint: type hint from `typing.get_type_hints`.
        name: name of the field, with the position in a container, such as `taps[0]`.
    """
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint is Any or isinstance(hint, TypeVar):
        return None
    if origin in (typing.Union, types.UnionType):
        problems = [mismatch(value, one, name) for one in arguments]
        return None if None in problems else _nested(problems, name) or _wrong(value, hint, name)
    if origin is Literal:
        return None if any(value is one or value == one for one in arguments) else _wrong(value, hint, name)
    if origin is collections.abc.Callable:
        return None if callable(value) else _wrong(value, hint, name)
    kind = origin or hint
    if not isinstance(value, (int, float) if kind is float else kind) or (kind in (int, float) and value is True):
        return _wrong(value, hint, name)
    if isinstance(value, str) and not value.isprintable():
        return f"{name} must be one line of printable text, got {printable(repr(value))}"
    return _item_problem(value, kind, arguments, name)


def _item_problem(value: Any, kind: type[Any], arguments: tuple[Any, ...], name: str) -> str | None:
    """The problem with an item of a container, or with a field of a dataclass."""
    items: list[tuple[str, Any, Any]] = []
    if kind is tuple and arguments[1:] == (...,):
        items = [(f"{name}[{number}]", one, arguments[0]) for number, one in enumerate(value)]
    elif kind is tuple:
        if len(value) != len(arguments):
            return f"{name} must hold {len(arguments)} values, got {len(value)}"
        items = [
            (f"{name}[{number}]", one, hint) for number, (one, hint) in enumerate(zip(value, arguments, strict=True))
        ]
    elif kind is frozenset:
        items = [(f"{name} item", one, arguments[0]) for one in value]
    elif kind is Mapping or kind is collections.abc.Mapping:
        items = [(f"{name} key", key, arguments[0]) for key in value]
        items += [(f"{name}[{printable(repr(key))}]", one, arguments[1]) for key, one in value.items()]
    elif dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        items = [(f"{name}.{field}", getattr(value, field), hint) for field, hint in hints.items()]
    problems = (mismatch(one, hint, place) for place, one, hint in items)
    return next((problem for problem in problems if problem is not None), None)


def _nested(problems: list[str | None], name: str) -> str | None:
    """The problem inside a value whose own type fits one member of a union; None if no member's own type fits."""
    return next((one for one in problems if one is not None and not one.startswith(f"{name} must be ")), None)


def _wrong(value: Any, hint: Any, name: str) -> str:
    got = printable(repr(value)) if typing.get_origin(hint) is Literal else type_name(value)
    return f"{name} must be {_described(hint)}, got {got}"


def _described(hint: Any) -> str:
    """A type hint in words: `a tuple`, `a Recipe or None`, `one of 'a', 'b'`."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint in (None, type(None)):
        return "None"
    if origin in (typing.Union, types.UnionType):
        return " or ".join(_described(one) for one in arguments)
    if origin is Literal:
        return f"one of {', '.join(map(repr, arguments))}"
    if origin is collections.abc.Callable:
        return "a function"
    name = (origin or hint).__name__
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
