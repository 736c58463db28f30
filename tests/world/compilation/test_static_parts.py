"""What goes around dm_control changes nothing in the compiled world; what is not plain goes through it."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.values.errors import TownError
from gear.world.assets.library import AssetLibrary
from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation import scene_mjcf
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.static_parts import MeshPath, SplitAsset, SplitTown, StaticParts, split_asset, split_town
from gear.world.compilation.world_plan import plan_world

WET = dataclasses.replace(CLEAR, wetness=100.0)
FIELDS = (
    "geom_type", "geom_pos", "geom_quat", "geom_size", "geom_bodyid", "geom_matid", "geom_dataid", "geom_rgba",
    "geom_group", "geom_contype", "body_pos", "body_quat", "body_parentid", "mat_rgba", "mat_roughness", "mesh_vert",
)  # fmt: skip


def names(model: mujoco.MjModel, kind: int, count: int) -> list[str]:
    return [mujoco.mj_id2name(model, kind, number) for number in range(count)]


def alike(one: mujoco.MjModel, other: mujoco.MjModel) -> bool:
    kinds = ((mujoco.mjtObj.mjOBJ_GEOM, one.ngeom, other.ngeom), (mujoco.mjtObj.mjOBJ_BODY, one.nbody, other.nbody))
    return all(names(one, kind, a) == names(other, kind, b) for kind, a, b in kinds) and all(
        np.array_equal(getattr(one, field), getattr(other, field)) for field in FIELDS
    )


def compiled(monkeypatch: pytest.MonkeyPatch, town: Path, *, is_whole: bool) -> CompiledWorld:
    with monkeypatch.context() as patch:
        if is_whole:
            patch.setattr(scene_mjcf, "split_town", lambda path: SplitTown(path=path, text=None, statics=StaticParts()))
            patch.setattr(scene_mjcf, "split_asset", lambda path: SplitAsset())
        return compile_world(plan_world(AssetLibrary.for_town(town), tiny_scenes().scenes["board"], WET))


def test_the_compiled_world_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    split = split_town(TINY_TOWN)
    text, statics = split.text, split.statics
    assert text is not None
    assert "<geom" in statics.xml and "<geom" not in text.partition("<worldbody>")[2] and "<numeric" in text
    quick, whole = (compiled(monkeypatch, TINY_TOWN, is_whole=is_whole) for is_whole in (False, True))
    assert alike(quick.model, whole.model) and alike(quick.placement_model, whole.placement_model)
    assert np.array_equal(quick.classes.label_code, whole.classes.label_code) and quick.faces == whole.faces
    dry = compile_world(plan_world(AssetLibrary.for_town(TINY_TOWN), tiny_scenes().scenes["board"], CLEAR))
    assert not np.array_equal(dry.model.mat_rgba, quick.model.mat_rgba)


@pytest.mark.parametrize(
    "thing",
    [
        '<body name="gate"><joint name="hinge"/><geom class="fence" size="1" mass="1"/></body>',
        '<body name="tower"><site name="top"/><geom class="building" size="1"/></body>',
        '<body name="group" childclass="building"><geom size="1"/></body>',
        '<body><geom class="building" size="1"/></body>',
        '<geom name="bare" size="1"/>',
        '<geom name="unnamed_geom_7" class="building" size="1"/>',
        '<body name="more"><include file="more.xml"/></body>',
    ],
    ids=["joint", "site", "childclass", "nameless body", "no class", "taken name", "include"],
)
def test_a_town_with_anything_else_is_left_whole(thing: str, tmp_path: Path) -> None:
    town = tmp_path / "town.xml"
    text = TINY_TOWN.read_text().replace("<worldbody>", f"<worldbody>{thing}", 1)
    town.write_text(text)
    split = split_town(town)
    assert split.text is None and split.statics == StaticParts() and not split.mesh_paths
    assert split.statics.insert_into("<worldbody><light/></worldbody>") == "<worldbody><light/></worldbody>"


@pytest.mark.parametrize(
    "more", ["", '<body><geom class="building.plaster" size="1 1 1"/></body>'], ids=["plain", "whole"]
)
def test_defaults_may_have_the_name_that_mujoco_writes(more: str, tmp_path: Path) -> None:
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    town = tmp_path / "towns" / "tiny.xml"
    worlds = []
    for start in ("<default>", '<default class="main">'):
        text = TINY_TOWN.read_text().replace("<default>", start, 1).replace("<worldbody>", f"<worldbody>{more}", 1)
        town.write_text(text)
        worlds.append(compile_world(plan_world(AssetLibrary.for_town(town), tiny_scenes().scenes["board"], CLEAR)))
    assert alike(worlds[0].model, worlds[1].model)


@pytest.mark.parametrize("setting", ["fusestatic", "discardvisual"])
def test_nothing_is_compiled_away(setting: str, tmp_path: Path) -> None:
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    town = tmp_path / "towns" / "tiny.xml"
    scene = tiny_scenes().scenes["board"]
    plain = compile_world(plan_world(AssetLibrary.for_town(town), scene, CLEAR))
    town.write_text(TINY_TOWN.read_text().replace('angle="degree"', f'angle="degree" {setting}="true"', 1))
    thinned = compile_world(plan_world(AssetLibrary.for_town(town), scene, CLEAR))
    assert alike(plain.model, thinned.model) and alike(plain.placement_model, thinned.placement_model)


ASSET = """<mujoco model="cart">
  <compiler meshdir="parts"/>
  <default><default class="seen"><mesh inertia="shell"/><default class="car.paint"/></default></default>
  <asset><mesh class="seen" name="box" file="box.obj"/></asset>
  <worldbody><geom class="car.paint" mesh="box"/></worldbody>
</mujoco>"""


def asset(folder: Path, text: str = ASSET) -> Path:
    (folder / "parts").mkdir()
    (folder / "parts" / "box.obj").write_text("v 0 0 0\n")
    (folder / "cart.xml").write_text(text)
    return folder / "cart.xml"


def test_an_asset_keeps_its_classes_and_its_meshes_stay_where_they_are(tmp_path: Path) -> None:
    split = split_asset(AssetFile(asset(tmp_path)))
    assert split.text is not None and "<default" not in split.text
    assert split.defaults.startswith('<default class="cart/"><default class="cart/seen"><mesh')
    assert '<default class="cart/car.paint"' in split.defaults
    mesh = str(tmp_path / "parts" / "box.obj")
    assert split.mesh_paths == {mesh: MeshPath(mesh.encode())} and f'file="{mesh}"' in split.text


@pytest.mark.parametrize(
    "found, put",
    [
        ("</default></default>", '<geom material="red"/></default></default>'),
        ("</default></default>", "<site/></default></default>"),
        ('<default><default class="seen">', '<default class="main"><default class="seen">'),
        ("<worldbody>", '<include file="more.xml"/><worldbody>'),
        ("<default><default", "<default/><default><default"),
    ],
    ids=["reference", "site", "named", "include", "two"],
)
def test_an_asset_with_anything_else_is_left_whole(found: str, put: str, tmp_path: Path) -> None:
    assert split_asset(AssetFile(asset(tmp_path, ASSET.replace(found, put, 1)))) == SplitAsset()


def test_a_mesh_that_is_not_there_is_named(tmp_path: Path) -> None:
    path = asset(tmp_path, ASSET.replace("box.obj", "ball.obj"))
    with pytest.raises(TownError, match=r"ball\.obj"):
        split_asset(AssetFile(path))
