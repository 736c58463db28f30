"""Triangles of geoms in the form that OpenGL draws."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gear.render.raster.geometry import DRAW_COMMAND, VERTEX, geometry_of

MJCF = """
<mujoco>
  <asset>
    <mesh name="m" vertex="0 0 0  2 0 0  0 2 0  0 0 2" face="0 2 1  0 1 3  0 3 2  1 2 3"/>
  </asset>
  <worldbody>
    <geom type="box" size="1 2 3"/>
    <geom type="box" size="1 2 3" pos="9 0 0"/>
    <geom type="box" size="1 2 4" pos="0 9 0"/>
    <geom type="mesh" mesh="m" pos="0 0 9"/>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(MJCF)


def test_geoms_of_one_shape_share_its_triangles(model: mujoco.MjModel) -> None:
    found = geometry_of(model, np.ones(4, bool))
    assert (found.vertices.dtype, found.commands.dtype) == (VERTEX, DRAW_COMMAND)
    assert found.geoms.tolist() == [0, 1, 2, 3]
    assert found.commands["count"].tolist() == [36, 36, 36, 12]
    assert found.commands["first"].tolist() == [0, 0, 36, 72]
    assert found.commands["base"][0] == found.commands["base"][1] == 0
    assert len(found.indices) == 36 + 36 + 12


def test_pieces_are_inside_their_spheres(model: mujoco.MjModel) -> None:
    found = geometry_of(model, np.ones(4, bool))
    np.testing.assert_allclose(found.radii_m[0], np.sqrt(14))
    np.testing.assert_allclose(found.centres_m[0], 0, atol=1e-9)
    for piece, command in enumerate(found.commands):
        begin, count = int(command["first"]), int(command["count"])
        points = found.vertices["position_m"][found.indices[begin : begin + count] + int(command["base"])]
        assert np.linalg.norm(points - found.centres_m[piece], axis=1).max() <= found.radii_m[piece] + 1e-5


def test_only_drawn_geoms_have_pieces(model: mujoco.MjModel) -> None:
    found = geometry_of(model, np.array([False, False, True, False]))
    assert found.geoms.tolist() == [2]
    assert found.commands["count"].tolist() == [36]
    nothing = geometry_of(model, np.zeros(4, bool))
    assert (len(nothing.vertices), len(nothing.commands), nothing.centres_m.shape) == (0, 0, (0, 3))
