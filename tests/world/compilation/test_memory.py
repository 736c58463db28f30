"""Memory of worker processes."""

from __future__ import annotations

import mujoco
import numpy as np

from gear.world.compilation.memory import disable_asset_cache, map_large_buffers, release_memory, release_render_arrays


def test_released_arrays_read_as_zeros_and_the_rest_stays() -> None:
    xml = """
    <mujoco>
      <asset><texture name="t" type="2d" builtin="flat" width="512" height="512" rgb1="1 1 1"/></asset>
      <worldbody><geom type="box" size="1 2 3"/></worldbody>
    </mujoco>
    """
    model = mujoco.MjModel.from_xml_string(xml)
    assert (np.asarray(model.tex_data) == 255).all()
    release_render_arrays(model)
    texels = np.asarray(model.tex_data)
    assert (texels == 0).mean() > 0.98  # pages that are shared with other arrays are kept
    assert model.geom_size[0].tolist() == [1.0, 2.0, 3.0]
    mujoco.mj_forward(model, mujoco.MjData(model))


def test_the_other_measures_change_no_result() -> None:
    capacity = mujoco.mj_getCacheCapacity(mujoco.mj_getCache())
    try:
        disable_asset_cache()
        assert mujoco.mj_getCacheCapacity(mujoco.mj_getCache()) == 0
        assert mujoco.mj_getCacheSize(mujoco.mj_getCache()) == 0
    finally:
        mujoco.mj_setCacheCapacity(mujoco.mj_getCache(), capacity)
    kept = np.arange(3 << 20)
    map_large_buffers()
    release_memory()
    assert (kept == np.arange(3 << 20)).all()
