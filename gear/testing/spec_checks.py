"""Checks that hold for the specs of all kinds of plugins."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gear.config.dump import to_yaml
from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.contracts.specs import AnySpec, Kind
from gear.plugins.spec_validation import spec_problem


def check_spec(kind: Kind, spec: AnySpec, options: Mapping[str, Any]) -> None:
    """Asserts that a plugin's spec is valid, and that its config is unchanged by a round trip through YAML.

    The config is tested with default options and with the options in the arguments.

    Args:
        kind: kind of plugin, such as `attack`.
        spec: the spec.
        options: options of the config, by name.

    Raises:
        AssertionError: the spec or its config fails a check.
    """
    assert spec_problem(kind, spec) is None, spec_problem(kind, spec)
    assert spec.summary and "\n" not in spec.summary, "the summary is one line"
    for config in (spec.config(), spec.config(**options)):
        assert read_node(spec.config, parse_text(to_yaml(config), "config")) == config
