"""Materials of geoms in the form that the shaders read."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gear.camera.response import decode_srgb
from gear.render.raster.materials import DIELECTRIC, TEXTURE_ROLES, materials_of

MJCF = """
<mujoco>
  <asset>
    <texture name="t" type="2d" builtin="flat" width="4" height="4" rgb1="1 0 0"/>
    <material name="rough" rgba="0.5 0.5 0.5 1" roughness="0.3" metallic="0.7" emission="0.2"/>
    <material name="shiny" rgba="0.5 0.5 0.5 1" shininess="1"/>
    <material name="image" texture="t"/>
  </asset>
  <worldbody>
    <geom type="box" size="1 1 1" rgba="0.2 0.4 0.6 1"/>
    <geom type="box" size="1 1 1" material="rough"/>
    <geom type="box" size="1 1 1" material="rough" rgba="0.1 0.1 0.1 1"/>
    <geom type="box" size="1 1 1" material="shiny"/>
    <geom type="box" size="1 1 1" material="image"/>
    <geom type="box" size="1 1 1" rgba="0.2 0.4 0.6 0"/>
  </worldbody>
</mujoco>
"""


def test_colours_surfaces_and_textures_of_geoms() -> None:
    found = materials_of(mujoco.MjModel.from_xml_string(MJCF))
    np.testing.assert_allclose(found.albedo[0], decode_srgb(np.array([0.2, 0.4, 0.6])), rtol=1e-5)
    np.testing.assert_allclose(found.albedo[1], decode_srgb(np.full(3, 0.5)), rtol=1e-5)
    np.testing.assert_allclose(found.albedo[2], decode_srgb(np.full(3, 0.1)), rtol=1e-5)
    np.testing.assert_allclose(found.surface[1], [0.3, 0.7, 0.2, DIELECTRIC], rtol=1e-5)
    assert found.surface[3, 0] == pytest.approx((2 / 130) ** 0.25)
    assert found.surface[0, 0] == pytest.approx((2 / 66) ** 0.25)
    base = list(TEXTURE_ROLES).index("HAS_BASE")
    assert found.textures[4, base] == 0
    assert (np.delete(found.textures.reshape(-1), 4 * len(TEXTURE_ROLES) + base) == -1).all()
    assert found.is_invisible.tolist() == [False] * 5 + [True]
