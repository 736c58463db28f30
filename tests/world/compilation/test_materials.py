"""Colours and textures of compiled geoms."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from gear.values.errors import TownError
from gear.world.compilation.materials import (
    effective_rgba,
    reject_fatal_textures,
    textures_of,
    visible_materials,
)


def model(material: str, texture: str = 'type="2d" builtin="flat" rgb1="1 1 1" width="4" height="4"') -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset><texture name="t" {texture}/><material name="m" texture="t" {material}/>
        <material name="plain" rgba="0.1 0.2 0.3 1"/></asset>
        <worldbody><geom name="collision" size="1" group="3" material="m"/><geom name="seen" size="1" material="m"/>
        <geom name="colour" size="1" material="plain"/><geom name="own" size="1" rgba="1 0 0 1"/>
        </worldbody></mujoco>"""
    )


def test_colours_come_from_the_material_unless_the_geom_has_its_own() -> None:
    rgba = effective_rgba(model('rgba="0.5 0.5 0.5 1"'))
    assert np.allclose(rgba[1:], [[0.5, 0.5, 0.5, 1], [0.1, 0.2, 0.3, 1], [1, 0, 0, 1]])


def test_hidden_geoms_show_no_material() -> None:
    compiled = model("")
    shown = visible_materials(compiled)
    assert shown == {
        compiled.mat("m").id: compiled.geom("seen").id,
        compiled.mat("plain").id: compiled.geom("colour").id,
    }
    assert [texture for _, texture in textures_of(compiled, compiled.mat("m").id)] == [compiled.tex("t").id]
    assert textures_of(compiled, compiled.mat("plain").id) == []


def test_a_cube_texture_on_a_physical_material_is_refused() -> None:
    cube = 'type="cube" builtin="flat" rgb1="1 1 1" width="4" height="24"'
    with pytest.raises(TownError, match="material 'm' of geom 'seen' has metallic or roughness and a cube texture"):
        reject_fatal_textures(model('metallic="0.5"', cube), Path("town.xml"))
    reject_fatal_textures(model("", cube), Path("town.xml"))
    reject_fatal_textures(model('metallic="0.5"'), Path("town.xml"))
