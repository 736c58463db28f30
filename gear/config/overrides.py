"""`--set key.path=value` on top of a file, read by the same reader."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gear.config.nodes import Mapping, Node, Place, Scalar, parse_value
from gear.config.reader import expand_shorthand
from gear.values.errors import ConfigError


def with_overrides(node: Node, settings: Iterable[str], kind: Any = None, *, flag: str = "--set") -> Node:
    """The tree with every `a.b.c=value` inserted; later settings override earlier ones.

    Args:
        node: the tree.
        settings: `KEY=VALUE` texts.
        kind: dataclass of the tree, whose shorthands are kept where a setting refers to a key below them; None for any.
        flag: flag that the settings were given with, for errors.

    Raises:
        ConfigError: a setting has no `=`, or its path leads through a value without keys.
    """
    hint = "such as --set weather.cloudiness=30" if kind else "with a key that `gear plugins show NAME` lists"
    for setting in settings:
        key, separator, text = setting.partition("=")
        name = f"{flag} {setting}"
        if not separator or not key.strip():
            raise ConfigError(name, 0, 0, "", f"expected KEY=VALUE, {hint}")
        text = f"'{text.strip()}'" if text.strip() == "-" else text  # to YAML a minus alone begins a list
        below = node if kind is None else expand_shorthand(kind, node)  # each time: a setting may be a bare word itself
        node = with_value(below, tuple(key.strip().split(".")), parse_value(text, name))
    return node


def with_value(node: Node, path: tuple[str, ...], value: Node, above: str = "") -> Node:
    """The tree with one value replaced or added.

    Args:
        node: the tree.
        path: keys from the root to the value.
        value: the new value.
        above: key of the tree itself, for errors.

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
    """Merges two trees: keys of `above` override, mappings are merged recursively, everything else is replaced."""
    if not (isinstance(base, Mapping) and isinstance(above, Mapping)):
        return above
    entries = dict(base.entries)
    for key, (place, item) in above.entries.items():
        entries[key] = (place, merged(entries[key][1], item) if key in entries else item)
    return Mapping(entries, above.place)
