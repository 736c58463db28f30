from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from gear.world.assets.geom_triangles import body_shape, geom_triangles

XML = """
<mujoco><asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 2 0 0 0 3"/></asset><worldbody>
<body name="b" pos="5 6 7" euler="0 0 90">
  <geom type="box" size="1 2 3"/><geom type="sphere" size="2"/><geom type="ellipsoid" size="1 2 3"/>
  <geom type="cylinder" size="1 2"/><geom type="capsule" size="1 2"/><geom type="mesh" mesh="wedge"/>
</body><geom type="plane" size="1 1 1"/></worldbody></mujoco>
"""
MODEL = mujoco.MjModel.from_xml_string(XML)
VOLUMES = (0.5 * 2 * 4 * 12, 32 / 3 * math.pi, 8 * math.pi, 4 * math.pi, 4 * math.pi + 4 / 3 * math.pi, 1.0)
GEOMS = [g for g in range(MODEL.ngeom) if MODEL.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE]


@pytest.mark.parametrize(("geom", "volume"), list(zip(GEOMS, VOLUMES, strict=True)))
def test_surfaces_are_closed_and_face_outward(geom: int, volume: float) -> None:
    vertices, faces = geom_triangles(MODEL, geom)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    signed = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert signed == pytest.approx(volume, rel=0.06)
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    drawn = edges[np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1) > 1e-9]
    spots = np.unique(np.round(vertices[drawn], 6).reshape(len(drawn), -1), axis=0, return_counts=True)[1]
    assert (spots % 2 == 0).all(), "every edge has a triangle on both sides"


def test_planes_have_no_triangles() -> None:
    plane = next(g for g in range(MODEL.ngeom) if g not in GEOMS)
    with pytest.raises(ValueError, match="no finite surface"):
        geom_triangles(MODEL, plane)


def test_shapes_are_in_the_frame_of_their_body() -> None:
    data = mujoco.MjData(MODEL)
    mujoco.mj_kinematics(MODEL, data)
    labels = np.arange(MODEL.ngeom, dtype=np.uint8)
    shape = body_shape(MODEL, data, MODEL.body("b").id, GEOMS[:1], labels)
    assert shape.box_size_m == pytest.approx([2, 4, 6])
    assert shape.box_centre_m == pytest.approx([0, 0, 0], abs=1e-9)
    assert set(shape.face_label_code) == {GEOMS[0]}
