"""Configs back to YAML with all defaults, as `gear show-config` prints them and every dataset keeps them."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import yaml

from gear.config.nodes import Items, Mapping, Node, Scalar
from gear.values.serial import Json, is_places_field

MAX_NODES = 100_000
"""Most values that a config may have once its YAML aliases are written out: aliases of aliases grow exponentially."""


def to_yaml(config: Any) -> str:
    """YAML text from which the same config is read."""
    return str(yaml.safe_dump(to_plain(config), sort_keys=False, allow_unicode=True, default_flow_style=None))


def node_to_json(node: Node) -> Json:
    """A YAML tree as JSON in which all scalars stay texts.

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
    """A config as JSON values: paths become texts, and options without a type stay texts."""
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
