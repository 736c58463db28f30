"""Models that are saved without their meshes' trees: everything else comes back, and the model itself is as before."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.world.compilation import drop_bvh
from gear.world.compilation.drop_bvh import without_mesh_bvh
from gear.world.compilation.mjb import read_model, write_model

CUBE = "1 1 1  1 1 -1  1 -1 1  1 -1 -1  -1 1 1  -1 1 -1  -1 -1 1  -1 -1 -1"
XML = f"""
<mujoco>
  <asset><mesh name="m" vertex="{CUBE}"/><mesh name="n" vertex="{CUBE}" scale="2 2 2"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 1"/>
    <geom name="g" type="mesh" mesh="m" pos="0 0 3"/>
    <geom name="h" type="mesh" mesh="n" pos="5 0 3"/>
    <body name="b" pos="0 3 1"><geom name="ball" size="0.3"/><geom type="mesh" mesh="m"/></body>
  </worldbody>
</mujoco>
"""
ABOVE = ((0.0, 0.0), (5.0, 0.5), (0.0, 3.0), (-4.0, -4.0))


def content(model: mujoco.MjModel) -> bytes:
    saved = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, saved)
    return saved.tobytes()


def hits(model: mujoco.MjModel) -> list[tuple[float, int]]:
    """Height and geom of what rays from above meet."""
    data, found = mujoco.MjData(model), np.zeros(1, np.int32)
    mujoco.mj_forward(model, data)
    down = np.array([0.0, 0.0, -1.0])
    lengths = [mujoco.mj_ray(model, data, np.array([x, y, 9.0]), down, None, 1, -1, found) for x, y in ABOVE]
    geoms = []
    for x, y in ABOVE:
        mujoco.mj_ray(model, data, np.array([x, y, 9.0]), down, None, 1, -1, found)
        geoms.append(int(found[0]))
    return [(round(9.0 - length, 6), geom) for length, geom in zip(lengths, geoms, strict=True)]


def test_a_model_comes_back_without_them(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before, whole = content(model), hits(model)
    with without_mesh_bvh(model):
        crc32 = write_model(model, tmp_path / "a.mjb")
    assert content(model) == before and hits(model) == whole
    there = read_model(tmp_path / "a.mjb", crc32)
    assert there.nbvh < model.nbvh and (tmp_path / "a.mjb").stat().st_size < len(before)
    of_trees = {"bvh_aabb", "bvh_child", "bvh_depth", "bvh_nodeid", "mesh_bvhadr", "mesh_bvhnum", "_sizes"}
    for name in {name for name in dir(model) if isinstance(getattr(model, name), np.ndarray)} - of_trees:
        assert np.array_equal(getattr(there, name), getattr(model, name)), name
    assert [geom for _, geom in whole] == [1, 2, 4, 0], "boards, a mesh above a ball, floor"
    floor, ball = model.geom("floor").id, model.geom("ball").id
    assert [geom for _, geom in hits(there)] == [floor, floor, ball, floor], "rays miss meshes and find all else"


def test_what_is_laid_out_otherwise_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before = content(model)
    monkeypatch.setattr(drop_bvh, "_NBVH", 6)
    with without_mesh_bvh(model):
        assert content(model) == before


@pytest.mark.parametrize("xml", ['<geom type="plane" size="1 1 1"/>', '<geom size="1"/><body><geom size="1"/></body>'])
def test_a_model_without_meshes_is_left_alone(xml: str) -> None:
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{xml}</worldbody></mujoco>")
    before = content(model)
    with without_mesh_bvh(model):
        assert content(model) == before


def test_it_is_as_before_after_an_error() -> None:
    model = mujoco.MjModel.from_xml_string(XML)
    before = content(model)
    with pytest.raises(OSError, match="full"), without_mesh_bvh(model):
        raise OSError("full")
    assert content(model) == before
