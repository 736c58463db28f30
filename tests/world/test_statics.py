"""What goes around dm_control changes nothing in the compiled world; what is not plain goes through it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.testing.tiny_town import CLEAR, TINY_TOWN, tiny_scenes
from gear.world import compose
from gear.world.assets import AssetLibrary
from gear.world.compiled import Compiled, compile_world
from gear.world.statics import Statics, split_town

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


def compiled(monkeypatch: pytest.MonkeyPatch, town: Path, *, is_whole: bool) -> Compiled:
    with monkeypatch.context() as patch:
        if is_whole:
            patch.setattr(compose, "split_town", lambda path: (None, Statics()))
        return compile_world(AssetLibrary.for_town(town), tiny_scenes().scenes["board"], WET)


def test_the_compiled_world_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    text, statics = split_town(TINY_TOWN)
    assert text is not None
    assert "<geom" in statics.xml and "<geom" not in text.partition("<worldbody>")[2] and "<numeric" in text
    quick, whole = (compiled(monkeypatch, TINY_TOWN, is_whole=is_whole) for is_whole in (False, True))
    assert alike(quick.model, whole.model) and alike(quick.placement_model, whole.placement_model)
    assert np.array_equal(quick.classes.label_code, whole.classes.label_code) and quick.faces == whole.faces
    dry = compile_world(AssetLibrary.for_town(TINY_TOWN), tiny_scenes().scenes["board"], CLEAR)
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
    left, statics = split_town(town)
    assert left is None and statics == Statics()
    assert statics.put_into("<worldbody><light/></worldbody>") == "<worldbody><light/></worldbody>"
