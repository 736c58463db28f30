"""Primitives are closed, face outwards and lie where rays find them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Stage
from gear.render.raster.primitives import Triangles, height_field, primitive
from tests.render.conftest import posed

GEOM = mujoco.mjtGeom


VOLUMES = {
    (GEOM.mjGEOM_BOX, (1.0, 2.0, 3.0)): 48.0,
    (GEOM.mjGEOM_SPHERE, (1.5, 0.0, 0.0)): 4 / 3 * math.pi * 1.5**3,
    (GEOM.mjGEOM_ELLIPSOID, (1.0, 2.0, 0.5)): 4 / 3 * math.pi,
    (GEOM.mjGEOM_CYLINDER, (0.5, 2.0, 0.0)): math.pi,
    (GEOM.mjGEOM_CAPSULE, (0.5, 2.0, 0.0)): math.pi + 4 / 3 * math.pi * 0.125,
}


def outwards(shape: Triangles) -> np.ndarray:
    """(T, 3) normals of triangles by the order of their corners, as long as twice their areas."""
    corners = shape.positions_m[shape.corners]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


@pytest.mark.parametrize(("kind", "size"), VOLUMES)
def test_a_solid_is_closed_and_looks_outwards(kind: mujoco.mjtGeom, size: tuple[float, ...]) -> None:
    shape = primitive(int(kind), np.array(size))
    across = outwards(shape)
    volume = np.einsum("ij,ij->", shape.positions_m[shape.corners[:, 0]], across) / 6
    assert volume == pytest.approx(VOLUMES[kind, size], rel=0.03)
    assert np.abs(across.sum(axis=0)).max() < 1e-9, "a hole"
    lean = np.einsum("ij,ij->i", across, shape.normals[shape.corners].mean(axis=1))
    assert (lean[np.linalg.norm(across, axis=1) > 1e-9] > 0).all()
    assert np.allclose(np.linalg.norm(shape.normals, axis=1), 1)
    assert (shape.texcoords >= 0).all() and (shape.texcoords <= 1).all()


def test_a_height_field_lies_where_rays_find_it() -> None:
    xml = (
        '<mujoco><asset><hfield name="h" nrow="5" ncol="7" size="3 2 1 0.1" '
        f'elevation="{" ".join(str((3 * k) % 11) for k in range(35))}"/></asset>'
        '<worldbody><geom type="hfield" hfield="h"/></worldbody></mujoco>'
    )
    model = mujoco.MjModel.from_xml_string(xml)
    shape = height_field(model, 0)
    assert (outwards(shape)[:, 2] > 0).all() and (shape.normals[:, 2] > 0).all()
    stage = Stage(model=model, data=posed(model))
    for middle in shape.positions_m[shape.corners].mean(axis=1)[::5]:
        hit = np.zeros(1, np.int32)
        down = np.array([0.0, 0.0, -1.0])
        distance = mujoco.mj_ray(model, stage.data, middle - 5 * down, down, None, 1, -1, hit)
        assert distance == pytest.approx(5, abs=0.35), "cells may be cut along either diagonal"


def test_what_is_no_solid_is_refused() -> None:
    with pytest.raises(ValueError, match="mjGEOM_MESH"):
        primitive(int(GEOM.mjGEOM_MESH), np.ones(3))
