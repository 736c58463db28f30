"""Facts about plugins for records."""

from __future__ import annotations

from gear.measuring.plugin_selection import Chosen
from gear.plugins.build import NO_OPTIONS, find
from gear.verbs.bench.plugin_facts import plugin_facts, without_folders


def test_paths_keep_their_last_part() -> None:
    value = {"weights": "/home/me/w.pt", "plugin": "package/net", "several": ["a/b", "c"], "n": 3}
    assert without_folders(value) == {"weights": "w.pt", "plugin": "package/net", "several": ["b", "c"], "n": 3}


def test_a_controller_is_named_with_its_code() -> None:
    facts = plugin_facts(Chosen(found=find("controller", "depth_baseline"), options=NO_OPTIONS))
    assert (facts.name, facts.package) == ("depth_baseline", "mujoco-gear") and len(facts.code_sha256) == 64
