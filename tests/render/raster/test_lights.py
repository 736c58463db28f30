"""Irradiance of environment maps, and lights by type."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from gear.render.raster.lights import irradiance_over_pi, lights_of
from tests.render.conftest import posed


def test_an_even_light_comes_from_everywhere_alike() -> None:
    light = irradiance_over_pi(np.full((6, 32, 32, 3), 0.3))
    assert np.allclose(light[0], 0.3) and np.allclose(light[1:], 0)
    bright_top = np.zeros((6, 32, 32, 3))
    bright_top[2] = 1.0
    light = irradiance_over_pi(bright_top)
    assert np.allclose(light[[1, 2]], 0) and (light[3] > 0.1).all()
    north = np.zeros((6, 32, 32, 3))
    north[5] = 1.0
    assert (irradiance_over_pi(north)[2] > 0.1).all(), "the cube's back is north"


def test_lights_are_taken_as_their_kinds_mean() -> None:
    xml = """<mujoco><worldbody>
      <light type="point" pos="0 0 3" diffuse="1 0 0" intensity="3840"/>
      <light type="directional" dir="0 0 -2" diffuse="0 1 0" castshadow="false"/>
      <light type="directional" dir="1 0 0" diffuse="0.5 0.5 0.5" intensity="38400"/>
      <geom size="1"/></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    lights = lights_of(model, posed(model))
    assert lights.casts_shadows and np.allclose(lights.towards[0], (-1, 0, 0, 0)), "what throws shadows comes first"
    assert np.allclose(lights.light, [[0.5, 0.5, 0.5], [0.1, 0, 0], [0, math.pi, 0]])
    assert np.allclose(lights.towards[1:], [(0, 0, 3, 1), (0, 0, 1, 0)])
