"""Checks of a town's materials."""

from __future__ import annotations

import mujoco
import numpy as np

from gear.testing.town_materials import transparent, unphysical

MJCF = """
<mujoco>
  <custom><numeric name="filament.linear_colors" data="1"/></custom>
  <asset>
    <texture name="data" type="2d" builtin="flat" width="4" height="4" rgb1="0.2 0.2 0.2"/>
    <material name="glass" rgba="0.5 0.5 0.5 0.5"/>
    <material name="hot" rgba="0.5 0.5 0.5 1" emission="3"/>
    <material name="image" texture="data"/>
  </asset>
  <worldbody>
    <geom name="plain" type="box" size="1 1 1" rgba="0.2 0.2 0.2 1"/>
    <geom name="clear" type="box" size="1 1 1" material="glass"/>
    <geom name="hidden" type="box" size="1 1 1" material="glass" group="3"/>
    <geom name="lamp" type="box" size="1 1 1" material="hot"/>
    <geom name="white" type="box" size="1 1 1" rgba="1 1 1 1"/>
    <geom name="sign" type="box" size="1 1 1" material="image"/>
  </worldbody>
</mujoco>
"""


def test_transparent_geoms_are_found_unless_hidden() -> None:
    (found,) = transparent(mujoco.MjModel.from_xml_string(MJCF))
    assert found == "geom 'clear' has an alpha of 0.5"


def test_unphysical_materials_are_found_unless_they_are_faces() -> None:
    model = mujoco.MjModel.from_xml_string(MJCF)
    found = "\n".join(unphysical(model, 0.9))
    assert "material 'hot' of geom 'lamp'" in found
    assert "white" in found
    assert "plain" not in found
    faces = np.array(
        [name in ("lamp", "white", "sign") for name in ("plain", "clear", "hidden", "lamp", "white", "sign")]
    )
    assert unphysical(model, 0.9, faces) == []
