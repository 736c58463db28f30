from __future__ import annotations

import dataclasses
import json
from typing import Any

from gear.contracts.tasks import SplitInfo
from gear.dataset.plan import Plan
from gear.measuring.appearance_hash import Look, current_look, light_digest, look_of, read_look
from gear.values.serial import to_json
from gear.world.assets.asset_hash import assets_digest
from gear.world.assets.library import AssetLibrary

LOOK = Look(assets={"a": "1", "b": "2"}, renderers=("filament",), light="3", mujoco="4.0")


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
    look = look_of(plans)
    assert look == dataclasses.replace(LOOK, light=light_digest())
    assert look.hash == look_of(reversed(plans)).hash and len(look.hash) == 16
    assert look_of([plan("a", "1", "raster"), plan("b", "2")]).hash == look.hash, "they look alike"
    assert look_of([plan("a", "1", "classic"), plan("b", "2")]).hash != look.hash
    mixed = look_of([*plans, plan("b", "2", "classic", "4.1.2")])
    assert mixed.renderers == ("classic", "filament") and mixed.mujoco == "4.0, 4.1"


def test_what_changed_is_said() -> None:
    assert LOOK.differences(LOOK) == []
    other = dataclasses.replace(LOOK, assets={"a": "1", "b": "x"}, light="y")
    assert LOOK.differences(other) == ["assets of b", "light"]
    assert other.hash != LOOK.hash
    assert LOOK.differences(dataclasses.replace(LOOK, assets={"a": "1"})) == ["assets of b"]


def test_looks_survive_json_and_rubbish_is_none() -> None:
    assert read_look(json.loads(json.dumps(to_json(LOOK)))) == LOOK
    for rubbish in ("text", 3, {"assets": 1}, {}):
        assert read_look(rubbish) is None


def test_the_look_of_now_is_that_of_what_is_installed() -> None:
    now = current_look(dataclasses.replace(LOOK, assets={"town10": "1", "atlantis": "2"}))
    assert now.assets == {"town10": assets_digest(AssetLibrary.for_town("town10"))}
    assert now.light == light_digest() and now.mujoco == "4.0"
