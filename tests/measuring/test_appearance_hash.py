from __future__ import annotations

import dataclasses
import json
from typing import Any

from gear.contracts.tasks import SplitInfo
from gear.dataset.plan import Plan
from gear.measuring.appearance_hash import Appearance, appearance_of, current_appearance, light_digest, read_appearance
from gear.values.serial import to_json
from gear.world.assets.asset_hash import assets_digest
from gear.world.assets.library import AssetLibrary

APPEARANCE = Appearance(assets={"a": "1", "b": "2"}, renderers=("filament",), light="3", mujoco="4.0")


def plan(town: str, assets: str, renderer: str = "filament", mujoco: str = "4.0.0") -> Plan:
    content: dict[str, Any] = {"town": town, "assets": assets, "renderer": {"name": renderer}}
    return Plan(
        task={"name": "semseg"},
        options={},
        content=content | {"versions": {"mujoco": mujoco}},
        patch={"label": "none", "sha256": ""},
        info=SplitInfo(town=town, scene="s", split="train", seed=0, patch_label="none"),
        samples=1,
    )


def test_a_look_follows_from_plans_whatever_their_order() -> None:
    plans = [plan("a", "1"), plan("b", "2"), plan("a", "1")]
    appearance = appearance_of(plans)
    assert appearance == dataclasses.replace(APPEARANCE, light=light_digest())
    assert appearance.hash == appearance_of(reversed(plans)).hash and len(appearance.hash) == 16
    assert appearance_of([plan("a", "1", "raster"), plan("b", "2")]).hash == appearance.hash, "they look alike"
    assert appearance_of([plan("a", "1", "classic"), plan("b", "2")]).hash != appearance.hash
    mixed = appearance_of([*plans, plan("b", "2", "classic", "4.1.2")])
    assert mixed.renderers == ("classic", "filament") and mixed.mujoco == "4.0, 4.1"


def test_what_changed_is_said() -> None:
    assert APPEARANCE.differences(APPEARANCE) == []
    other = dataclasses.replace(APPEARANCE, assets={"a": "1", "b": "x"}, light="y")
    assert APPEARANCE.differences(other) == ["assets of b", "light"]
    assert other.hash != APPEARANCE.hash
    assert APPEARANCE.differences(dataclasses.replace(APPEARANCE, assets={"a": "1"})) == ["assets of b"]


def test_looks_survive_json_and_rubbish_is_none() -> None:
    assert read_appearance(json.loads(json.dumps(to_json(APPEARANCE)))) == APPEARANCE
    for rubbish in ("text", 3, {"assets": 1}, {}):
        assert read_appearance(rubbish) is None


def test_the_current_appearance_is_that_of_the_installed_files() -> None:
    now = current_appearance(dataclasses.replace(APPEARANCE, assets={"town10": "1", "atlantis": "2"}))
    assert now.assets == {"town10": assets_digest(AssetLibrary.for_town("town10"))}
    assert now.light == light_digest() and now.mujoco == "4.0"
