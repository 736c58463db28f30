"""Puts the values of `--set key.path=value` into a parsed config."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gear.config.nodes import Mapping, Node, Place, Scalar, parse_value
from gear.config.reader import expand_shorthand
from gear.values.errors import ConfigError
from gear.values.setting import Setting

LONGEST = 200
"""Largest number of characters of a setting in an error message."""


def with_overrides(node: Node, settings: Iterable[str], kind: Any = None) -> Node:
    """Inserts the values of `--set` options into a YAML tree; later settings override earlier ones.

    Args:
        node: the tree.
        settings: `KEY=VALUE` texts; the key may be a path with dots, such as `weather.cloudiness`. Errors name a
            `Setting` as it was given, and any other text as a value of `--set`.
        kind: dataclass of the tree. Its shorthands (`weather: ClearNoon`) are expanded to mappings, so keys below them
            can be set. None if the tree has no such class.

    Raises:
        ConfigError: a setting has no `=`, or its path leads through a value without keys.
    """
    hint = "such as --set weather.cloudiness=30" if kind else "with a key that `gear plugins show NAME` lists"
    for setting in settings:
        key, separator, text = setting.partition("=")
        given = (setting if isinstance(setting, Setting) else Setting(setting)).given
        name = given if len(given) <= LONGEST else given[:LONGEST] + "…"
        if not separator or not key.strip():
            raise ConfigError(name, 0, 0, "", f"expected KEY=VALUE, {hint}")
        text = f"'{text.strip()}'" if text.strip() == "-" else text  # to YAML a minus alone begins a list
        below = node if kind is None else expand_shorthand(kind, node)  # each time: a setting may be a bare word itself
        node = with_value(below, tuple(key.strip().split(".")), parse_value(text, name))
    return node


def with_value(node: Node, path: tuple[str, ...], value: Node, above: str = "") -> Node:
    """A copy of a YAML tree with one value replaced or added.

    Args:
        node: the tree.
        path: keys from the root to the value.
        value: the new value.
        above: key of the tree itself, for error messages.

    Raises:
        ConfigError: the path leads through a list or a scalar.
    """
    if not path:
        return value
    place = Place(value.place.path)
    if isinstance(node, Scalar) and node.is_null:
        node = Mapping({}, place)
    if not isinstance(node, Mapping):
        shown = repr(node.text) if isinstance(node, Scalar) else "a list"
        raise place.error(above, f"is {shown}, which has no key {path[0]!r}; set it as a whole")
    key_place, below = node.entries.get(path[0], (place, Mapping({}, place)))
    entry = (key_place, with_value(below, path[1:], value, f"{above}.{path[0]}" if above else path[0]))
    return Mapping({**node.entries, path[0]: entry}, node.place)


def merged(base: Node, above: Node) -> Node:
    """Merges two YAML trees: mappings are merged recursively, and any other value of `above` replaces the one of
    `base`.

    Args:
        base: the tree with lower priority.
        above: the tree with higher priority.

    Returns:
        A new tree.
    """
    if not (isinstance(base, Mapping) and isinstance(above, Mapping)):
        return above
    entries = dict(base.entries)
    for key, (place, item) in above.entries.items():
        entries[key] = (place, merged(entries[key][1], item) if key in entries else item)
    return Mapping(entries, above.place)
