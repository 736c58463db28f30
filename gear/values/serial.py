"""Converts frozen dataclasses to JSON and back, according to the declared types of their fields."""

from __future__ import annotations

import dataclasses
import types
from functools import cache
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from gear.values.errors import FieldError

Json = Any
"""Type of a JSON value as `json.loads` returns it: None, bool, int, float, str, list, or dict with string keys."""

T = TypeVar("T")

PLACES = {"places": True}
"""Metadata of the field of a config that stores the position (file, line and column) of each value in the config
file. The config reader fills this field; it is no key of the config and is not written.
"""

SHOWN = 60
"""Largest number of characters of an invalid value that an error message quotes."""


def to_json(value: Any) -> Json:
    """Converts a value to JSON: dataclasses become dicts, tuples become lists.

    Args:
        value: a dataclass, tuple, list, mapping or plain value.

    Raises:
        TypeError: a value has no JSON form.
    """
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        said = [field.name for field in dataclasses.fields(value) if not is_places_field(field)]
        return {name: to_json(getattr(value, name)) for name in said}
    if isinstance(value, (tuple, list)):
        return [to_json(item) for item in value]
    if isinstance(value, dict):
        return {str(key): to_json(item) for key, item in value.items()}
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise TypeError(f"{type(value).__name__} has no JSON form")


def is_places_field(field: dataclasses.Field[Any]) -> bool:
    """Whether a field stores the positions (file, line, column) of the other fields' values in a config file; such
    a field is no key of the config (`PLACES`).

    Args:
        field: the field of a dataclass.
    """
    return PLACES.items() <= field.metadata.items()


@cache
def type_hints(cls: Any) -> dict[str, Any]:
    """The types of a class's attributes by name, with text annotations resolved."""
    return get_type_hints(cls)


def from_json(kind: type[T], value: Json, where: str = "") -> T:
    """Converts a JSON value to a declared type, such as a dataclass.

    Args:
        kind: a dataclass, or any type that its fields may have.
        value: the JSON value.
        where: key of `value`, for errors.

    Raises:
        FieldError: a key is unknown or missing, or a value has another type; the error names the key.
    """
    return cast(T, _read(kind, value, where))


def _read(kind: Any, value: Json, where: str) -> Any:
    if type(value) is kind:  # most values are numbers and texts
        return value
    origin = get_origin(kind)
    if kind is Any:
        return value
    if origin in (Union, types.UnionType):
        options = get_args(kind)
        if value is None and type(None) in options:
            return None
        return _read(next(option for option in options if option is not type(None)), value, where)
    if origin is Literal:
        if value not in get_args(kind):
            raise FieldError(where, f"expected one of {', '.join(map(str, get_args(kind)))}, got {_shown(value)}")
        return value
    if origin is tuple:
        return _read_tuple(get_args(kind), value, where)
    if origin is dict:
        if not isinstance(value, dict):
            raise FieldError(where, f"expected a mapping, got {_shown(value)}")
        item_kind = get_args(kind)[1]
        return {key: _read(item_kind, item, f"{where}.{key}") for key, item in value.items()}
    if dataclasses.is_dataclass(kind):
        return _read_dataclass(kind, value, where)
    return _read_scalar(kind, value, where)


def _read_tuple(kinds: tuple[Any, ...], value: Json, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise FieldError(where, f"expected a list, got {_shown(value)}")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(_read(kinds[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    if len(kinds) != len(value):
        raise FieldError(where, f"expected {len(kinds)} items, got {len(value)}")
    return tuple(_read(k, item, f"{where}[{i}]") for i, (k, item) in enumerate(zip(kinds, value, strict=True)))


def _read_dataclass(kind: Any, value: Json, where: str) -> Any:
    if not isinstance(value, dict):
        raise FieldError(where, f"expected a mapping, got {_shown(value)}")
    hints = type_hints(kind)
    fields = {field.name: field for field in dataclasses.fields(kind) if not is_places_field(field)}
    for key in value:
        if key not in fields:
            raise FieldError(f"{where}.{key}".lstrip("."), "unknown key")
    prefix = f"{where}." if where else ""
    given = {key: _read(hints[key], item, prefix + key) for key, item in value.items()}
    for name, field in fields.items():
        has_default = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if name not in given and not has_default:
            raise FieldError(f"{where}.{name}".lstrip("."), "missing")
    try:
        return kind(**given)
    except FieldError as error:
        raise FieldError(prefix + error.field, error.problem) from error


def _read_scalar(kind: Any, value: Json, where: str) -> Any:
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError as error:
            raise FieldError(where, f"is too large, {_shown(value)}") from error
    if kind in (int, float) and isinstance(value, bool):
        raise FieldError(where, f"expected {kind.__name__}, got {_shown(value)}")
    if not isinstance(value, kind):
        raise FieldError(where, f"expected {getattr(kind, '__name__', kind)}, got {_shown(value)}")
    return value


def _shown(value: Json) -> str:
    """A value for a message of one line, cut at `SHOWN` characters."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."
