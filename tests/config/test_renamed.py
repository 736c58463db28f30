"""An unknown key names its new name, or the known key with the most similar spelling."""

from __future__ import annotations

import dataclasses

import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.config.renamed import RENAMED, unknown_key
from gear.plugins.defenses.activations.zmask_options import ZMaskConfig
from gear.plugins.manager import catalogue
from gear.values.errors import ConfigError
from gear.verbs.train.config import TrainConfig


def test_a_renamed_key_names_the_new_one() -> None:
    assert unknown_key("only_if_sure", ["rows", "only_on_alarm"]) == ("unknown key (it is called 'only_on_alarm' now)")
    message = unknown_key("only_if_sure", ["rows"])
    assert message == "unknown key (there are: rows)", "the new key does not exist here"


def test_a_misspelt_key_names_a_similar_one() -> None:
    assert unknown_key("colour", ["color", "size"]) == "unknown key (did you mean 'color'?)"
    assert unknown_key("xyz", ["color", "size"]) == "unknown key (there are: color, size)"
    assert unknown_key("xyz", []) == "unknown key (there are none)"


def test_every_new_name_is_a_key_of_a_plugin_or_of_training() -> None:
    configs = [entry.spec.config for entry in catalogue().found if hasattr(entry.spec, "config")]
    keys = {field.name for config in (*configs, TrainConfig) for field in dataclasses.fields(config)}
    assert set(RENAMED.values()) <= keys
    assert not RENAMED.keys() & keys, "a key with this name exists, so the hint would never appear"


def test_a_config_with_a_renamed_key_is_refused_with_its_place() -> None:
    with pytest.raises(ConfigError, match=r"zmask.yml:2:1: only_if_sure: .*'only_on_alarm' now"):
        read_node(ZMaskConfig, parse_text("rows: 40\nonly_if_sure: true\n", "zmask.yml"))
