"""Converts configs to YAML and JSON with all defaults, for `gear show-config` and for the manifests of datasets."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import yaml

from gear.config.nodes import Items, Mapping, Node, Scalar
from gear.values.serial import Json, is_places_field

MAX_NODES = 100_000
"""Largest number of values in a config after its YAML aliases are expanded; nested aliases can grow exponentially."""


def to_yaml(config: Any) -> str:
    """Converts a config to YAML text, from which the same config can be read.

    Args:
        config: a config dataclass.
    """
    return str(yaml.safe_dump(to_plain(config), sort_keys=False, allow_unicode=True, default_flow_style=None))


def node_to_json(node: Node) -> Json:
    """Converts a parsed YAML tree to JSON in which numbers and booleans stay text.

    Args:
        node: the parsed tree.

    Raises:
        ConfigError: the tree is too large once its aliases are expanded.
    """
    if _count(node, {}) > MAX_NODES:
        raise node.place.error("", f"holds more than {MAX_NODES} values with its aliases written out")
    return _written_out(node)


def _count(node: Node, known: dict[int, int]) -> int:
    """Number of nodes with aliases expanded; `known` holds the numbers of nodes visited before."""
    if isinstance(node, Scalar):
        return 1
    if id(node) not in known:
        below = node.items if isinstance(node, Items) else [item for _, item in node.entries.values()]
        known[id(node)] = 1 + sum(_count(item, known) for item in below)
    return known[id(node)]


def _written_out(node: Node) -> Json:
    if isinstance(node, Scalar):
        return None if node.is_null else node.text
    if isinstance(node, Items):
        return [_written_out(item) for item in node.items]
    return {key: _written_out(item) for key, (_, item) in node.entries.items()}


def to_plain(value: Any) -> Json:
    """Converts a config to JSON values; paths become texts, and values without a declared type stay texts.

    Args:
        value: a config dataclass, or any value of its fields.
    """
    if isinstance(value, (Scalar, Items, Mapping)):
        return node_to_json(value)
    if isinstance(value, Path):
        return str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        said = [field.name for field in dataclasses.fields(value) if not is_places_field(field)]
        return {name: to_plain(getattr(value, name)) for name in said}
    if isinstance(value, (tuple, list)):
        return [to_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: to_plain(item) for key, item in value.items()}
    return value
