"""Checks of the networks, defenses and the attack of a bench."""

from __future__ import annotations

import pytest

from gear.config.nodes import parse_text
from gear.config.reader import read_node
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import ConfigError, GearError
from gear.verbs.bench.config import BenchConfig
from gear.verbs.bench.validation import DECIDED, TaskPlugins, check_collect, find_attack, plugins_of_tasks

TASK = "tasks: {semseg: {models: {net: {plugin: ddrnet23_slim, set: {weights: none}}}%s}}\nplaces: {town10: []}\n"


def checked(rest: str = "", defenses: str = "") -> tuple[PluginEntry, tuple[TaskPlugins, ...]]:
    node = parse_text(TASK % defenses + rest, "b.yml")
    config = read_node(BenchConfig, node)
    attack = find_attack(config, node)
    return attack, tuple(plugins_of_tasks(config, node, attack=attack, surfaces=1, device="cpu"))


def test_entrants_keep_their_names_and_order() -> None:
    attack, (task_plugins,) = checked("attack: {plugin: eot}\n", ", defenses: {squeeze: {plugin: jpeg}, median: {}}")
    assert attack.spec.name == "eot"
    assert task_plugins.name == "semseg"
    assert [(one.label, one.plugin) for one in task_plugins.models] == [("net", "ddrnet23_slim")]
    assert [one.label for one in task_plugins.defenses] == ["squeeze", "median"]
    assert [None if one is None else one.label for one in task_plugins.guards] == [None, "squeeze", "median"]
    assert not task_plugins.defenses[0].needs_calibration


@pytest.mark.parametrize(
    ("rest", "defenses", "message"),
    [
        ("attack: {plugin: eott}\n", "", r"b.yml:3:\d+: attack.plugin: no attack named 'eott'; did you mean eot"),
        ("attack: {plugin: eot, set: {shar: 1}}\n", "", r"b.yml:3:\d+: attack.set.*shar"),
        ("", ", defenses: {jpg: {}}", r"b.yml:1:\d+: .*jpg"),
        ("", ", defenses: {fpda: {}}", r"calibrat"),
    ],
)
def test_mistakes_have_their_place_in_the_file(rest: str, defenses: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        checked(rest, defenses)


GIVEN = {
    "task": "semseg", "town": "town10", "scene": "truck", "scenes": "my.yml", "weather": "ClearNoon", "samples": "4",
    "seed": "3", "split": "test", "root": "thesis", "patch": "none", "patch_seed": "0", "probes": "false",
}  # fmt: skip
"""A value of each key that a benchmark decides; some are the defaults, which also override the benchmark's values."""


@pytest.mark.parametrize("key", DECIDED)
def test_what_a_benchmark_decides_cannot_be_set_by_collect(key: str) -> None:
    with pytest.raises(GearError, match=rf"^'{key}' is decided by the benchmark, so collect must not set it") as caught:
        check_collect("semseg", ["quality=fast", f"{key}={GIVEN[key]}"])
    assert "\n" not in str(caught.value)


def test_other_spellings_of_a_key_are_seen_too() -> None:
    for setting in ("weather.cloudiness=30", "root=thesis={a: 1}"):
        with pytest.raises(GearError):
            check_collect("semseg", [setting])


def test_collect_may_set_how_pictures_are_made() -> None:
    check_collect("semseg", ["quality=fast", "renderer=classic", "crowd=2", "options.width_px=256", "mix.bus=3"])
