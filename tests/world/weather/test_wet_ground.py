"""Open ground gets darker and smoother by its wetness; nothing else does."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from gear.world.assets.geom_classes import classify
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.weather.wet_ground import wet_materials, wet_own_colours

XML = """<mujoco model="town">
  <default><default class="road"><geom material="asphalt"/></default><default class="building"/></default>
  <asset>
    <material name="asphalt" rgba="0.4 0.4 0.4 1" roughness="0.8"/>
    <material name="marking" rgba="0.8 0.8 0.8 1"/>
    <material name="brick" rgba="0.5 0.2 0.2 1" roughness="0.9"/>
  </asset>
  <worldbody>
    <geom name="lane" class="road" size="1"/>
    <geom name="line" class="road" material="marking" size="1"/>
    <geom name="house" class="building" material="brick" size="1"/>
  </worldbody>
</mujoco>"""


def materials(amount: float) -> dict[str, tuple[float, float | None]]:
    root = mjcf.from_xml_string(XML)
    wet_materials(root, amount)
    return {m.name: (float(m.rgba[0]), m.roughness) for m in root.find_all("material")}


def test_materials_of_open_ground_are_wet() -> None:
    dry, damp, wet = (materials(amount) for amount in (0.0, 0.5, 1.0))
    for name in ("asphalt", "marking"):
        assert dry[name][0] > damp[name][0] > wet[name][0] > 0
    roughness = [one["asphalt"][1] for one in (dry, damp, wet)]
    assert roughness == sorted(roughness, reverse=True) and roughness[2] < roughness[0]  # type: ignore[type-var]
    assert dry["brick"] == wet["brick"] and wet["marking"][1] is None


def test_geoms_that_are_not_in_the_tree_count_by_their_class_and_material() -> None:
    root = mjcf.from_xml_string(XML)
    for geom in list(root.find_all("geom")):
        geom.remove()
    wet_materials(root, 1.0, [("road", None), ("building", "brick")])
    found = {m.name: float(m.rgba[0]) for m in root.find_all("material")}
    assert found["asphalt"] < 0.4 and found["marking"] == 0.8 and found["brick"] == 0.5


def test_colours_of_geoms_are_wet() -> None:
    xml = """<mujoco><default><default class="road"/><default class="building"/></default><worldbody>
      <geom class="road" size="1" rgba="0.4 0.4 0.4 1"/><geom class="building" size="1" rgba="0.4 0.4 0.4 1"/>
    </worldbody></mujoco>"""
    spec = mujoco.MjSpec.from_string(xml)
    model = spec.compile()
    wet_own_colours(model, classify(spec, Path("town.xml")).label_code, 1.0)
    np.testing.assert_allclose(model.geom_rgba[1], (0.4, 0.4, 0.4, 1.0), rtol=1e-6)
    assert (model.geom_rgba[0, :3] < 0.3).all() and model.geom_rgba[0, 3] == 1
