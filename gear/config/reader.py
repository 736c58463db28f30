"""Reads YAML trees into frozen dataclasses; the declared type of each field decides how its text is read."""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import math
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, cast, get_args, get_origin

from gear.config.nodes import Items, Mapping, Node, Place, Scalar
from gear.config.renamed import unknown_key
from gear.values.errors import DuplicateNameError, FieldError, PatchError, UnknownNameError
from gear.values.serial import is_places_field, type_hints

T = TypeVar("T")

TRUE_WORDS = ("true", "yes", "on")
FALSE_WORDS = ("false", "no", "off")

WHOLE = {"whole": True}
"""Metadata of a field whose default is used only if none of its keys is given; else the defaults of its class hold."""


def read_node(kind: type[T], node: Node, key: str = "") -> T:
    """Reads a YAML tree as a value of the type `kind`, usually a dataclass.

    - A dataclass may name in `SHORTHAND` the field that a bare word fills: `weather: ClearNoon`.
    - A field of type `Node` is kept as a tree, for code that knows its type later.
    - For a field that is itself a dataclass, missing keys have the values of the field's default. With `WHOLE` in the
      field's metadata, they have the defaults of the dataclass.

    Args:
        kind: type of the result.
        node: the tree.
        key: key of the tree in the whole config, for error messages.

    Raises:
        ConfigError: a key is unknown, missing or repeated, a value has another type, or the dataclass refuses a value.
    """
    return cast(T, _read(kind, node, key))


@contextlib.contextmanager
def located_errors(places: dict[str, Place], key: str, above: str = "") -> Iterator[None]:
    """A context for looking up a name that a config contains; errors get the file, line and column of the name.

    Args:
        places: position of each given value, by key.
        key: key of the name.
        above: key of the mapping that contains `key`, if there is one.

    Raises:
        ConfigError: an `UnknownNameError`, `DuplicateNameError` or `PatchError` was raised, and a file contains the
            key.
    """
    try:
        yield
    except (UnknownNameError, DuplicateNameError, PatchError) as error:
        place = places.get(key)
        if place is None or not place.line:
            raise
        raise place.error(join(above, key), str(error)) from error


def expand_shorthand(kind: Any, node: Node) -> Node:
    """Expands shorthands in the YAML tree of a dataclass, so that further keys can be set.

    For example, `weather: ClearNoon` becomes `weather: {preset: ClearNoon}`.

    Args:
        kind: class of the dataclass.
        node: the YAML tree.
    """
    if not isinstance(node, Mapping):
        return node
    hints = type_hints(kind)
    return Mapping(
        {name: (place, _in_full(hints.get(name), item)) for name, (place, item) in node.entries.items()}, node.place
    )


def _in_full(kind: Any, node: Node) -> Node:
    shorthand = getattr(kind, "SHORTHAND", None)
    if shorthand and isinstance(node, Scalar) and not node.is_null:
        return Mapping({shorthand: (node.place, node)}, node.place)
    return node


def _read(kind: Any, node: Node, key: str, default: Any = None) -> Any:
    if kind == Node:
        return node
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        options = get_args(kind)
        if isinstance(node, Scalar) and node.is_null and type(None) in options:
            return None
        return _read(next(option for option in options if option is not type(None)), node, key, default)
    if origin is Literal:
        return _read_choice(get_args(kind), node, key)
    if origin is tuple:
        return _read_tuple(get_args(kind), node, key)
    if origin is dict:
        mapping = _expect_mapping(node, key)
        item_kind = get_args(kind)[1]
        return {name: _read(item_kind, item, join(key, name)) for name, (_, item) in mapping.entries.items()}
    if dataclasses.is_dataclass(kind):
        return _read_dataclass(kind, node, key, default if type(default) is kind else None)
    return _read_scalar(kind, node, key)


def join(key: str, name: str) -> str:
    """The key path `key.name`; only `name` if `key` is empty.

    Args:
        key: the key of the mapping.
        name: the key inside the mapping.
    """
    return f"{key}.{name}" if key else name


def _expect_mapping(node: Node, key: str) -> Mapping:
    if isinstance(node, Scalar) and node.is_null:
        return Mapping({}, node.place)
    if not isinstance(node, Mapping):
        raise node.place.error(key, f"expected keys and values, got {_shown(node)}")
    return node


def _read_dataclass(kind: Any, node: Node, key: str, default: Any) -> Any:
    """Reads a dataclass; missing keys are taken from `default`, or from the class where `default` is None."""
    mapping = _expect_mapping(_in_full(kind, node), key)
    hints = type_hints(kind)
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init and not is_places_field(field)}
    given = {} if default is None else {name: getattr(default, name) for name in fields}
    places: dict[str, Place] = {}
    for name, (place, item) in mapping.entries.items():
        if name not in fields:
            raise place.error(join(key, name), unknown_key(name, fields))
        given[name] = _read(hints[name], item, join(key, name), _usual(fields[name], default))
        places[name] = item.place
        if get_origin(hints[name]) is dict and isinstance(item, Mapping):
            places |= {join(name, each): value.place for each, (_, value) in item.entries.items()}
    for name, field in fields.items():
        has_default = field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING
        if name not in given and not has_default:
            raise mapping.place.error(join(key, name), "missing")
    given.update({field.name: places for field in dataclasses.fields(kind) if is_places_field(field)})
    try:
        return kind(**given)
    except FieldError as error:
        raise places.get(error.field, mapping.place).error(join(key, error.field), error.problem) from error


def _usual(field: dataclasses.Field[Any], default: Any) -> Any:
    """The value of a field whose key is missing: that of `default`, if there is one; None where the class decides."""
    if WHOLE.items() <= field.metadata.items():
        return None
    if default is not None:
        return getattr(default, field.name)
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return None if field.default is dataclasses.MISSING else field.default


def _read_tuple(kinds: tuple[Any, ...], node: Node, key: str) -> tuple[Any, ...]:
    if not isinstance(node, Items):
        raise node.place.error(key, f"expected a list, got {_shown(node)}")
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(_read(kinds[0], item, f"{key}[{i}]") for i, item in enumerate(node.items))
    if len(kinds) != len(node.items):
        raise node.place.error(key, f"expected {len(kinds)} items, got {len(node.items)}")
    return tuple(_read(k, item, f"{key}[{i}]") for i, (k, item) in enumerate(zip(kinds, node.items, strict=True)))


def _read_choice(choices: tuple[Any, ...], node: Node, key: str) -> Any:
    text = _text(node, key, "one of " + ", ".join(map(str, choices)))
    for choice in choices:
        if str(choice) == text:
            return choice
    close = difflib.get_close_matches(text, [str(choice) for choice in choices], n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    raise node.place.error(key, f"expected one of {', '.join(map(str, choices))}, got {text!r}{hint}")


def _read_scalar(kind: Any, node: Node, key: str) -> Any:
    text = _text(node, key, kind.__name__)
    if kind is str:
        return text
    if kind is Path:
        return Path(text)
    if kind is bool:
        if text.casefold() in TRUE_WORDS:
            return True
        if text.casefold() in FALSE_WORDS:
            return False
    elif kind is int:
        try:
            return int(text)
        except ValueError:
            pass
    elif kind is float:
        try:
            number = float(text)
        except ValueError:
            pass
        else:
            if math.isfinite(number):
                return number
    else:
        raise TypeError(f"{key}: a config field cannot have type {kind!r}")
    raise node.place.error(key, f"expected {kind.__name__}, got {text!r}")


def _text(node: Node, key: str, expected: str) -> str:
    if not isinstance(node, Scalar) or node.is_null:
        raise node.place.error(key, f"expected {expected}, got {_shown(node)}")
    return node.text


def _shown(node: Node) -> str:
    if isinstance(node, Scalar):
        return "nothing" if node.is_null else repr(node.text)
    return "a list" if isinstance(node, Items) else "keys and values"
