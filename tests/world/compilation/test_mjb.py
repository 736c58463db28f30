"""Compiled models in files: the same model comes back, by either way, and a damaged file is refused."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.world.compilation import mjb
from gear.world.compilation.mjb import read_model, write_model

XML = """
<mujoco>
  <asset>
    <texture name="t" type="2d" builtin="checker" width="64" height="64" rgb1="1 0 0" rgb2="0 1 0"/>
    <mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
  </asset>
  <worldbody><geom name="g" type="mesh" mesh="m"/><body name="b"><freejoint/><geom size="0.3"/></body></worldbody>
</mujoco>
"""


@pytest.mark.parametrize("is_hidden", [False, True])
def test_a_model_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_hidden: bool) -> None:
    """Also where MuJoCo's bindings do not show the quick way."""
    if is_hidden:
        monkeypatch.setattr(mjb, "_model_in", lambda content: None)
    model, path = mujoco.MjModel.from_xml_string(XML), tmp_path / "a.mjb"
    crc32 = write_model(model, path)
    there = read_model(path, crc32)
    assert path.stat().st_size == mujoco.mj_sizeModel(model)
    for name in ("geom_pos", "mesh_vert", "tex_data", "names", "body_mass"):
        assert np.array_equal(getattr(there, name), getattr(model, name)), name
    data = mujoco.MjData(there)
    mujoco.mj_step(there, data)
    assert data.qpos[2] < 0, "what was read lives: the body falls"


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mjb"
    crc32 = write_model(mujoco.MjModel.from_xml_string(XML), path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match="is not what was written there"):
        read_model(path, crc32)
    with pytest.raises(OSError, match="nowhere"):
        read_model(tmp_path / "nowhere", crc32)


def test_ctrl_c_while_a_file_is_read_or_written_is_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was an error about arrays that still looked at a closed map, with a traceback."""
    model, path = mujoco.MjModel.from_xml_string(XML), tmp_path / "a.mjb"
    crc32 = write_model(model, path)

    def interrupted(content: np.ndarray) -> mujoco.MjModel:
        raise KeyboardInterrupt

    monkeypatch.setattr(mjb, "_model_in", interrupted)
    with pytest.raises(KeyboardInterrupt):
        read_model(path, crc32)
    monkeypatch.setattr(mjb.isal_zlib, "crc32", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_model(model, tmp_path / "b.mjb")


def test_the_quick_way_is_there_with_the_mujoco_that_is_pinned(tmp_path: Path) -> None:
    path = tmp_path / "a.mjb"
    write_model(mujoco.MjModel.from_xml_string(XML), path)
    assert mjb._model_in(np.fromfile(path, np.uint8)) is not None
