"""What is left out must not be visible."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gear.render.culling import in_beam, in_frustum, may_shadow
from gear.render.pinhole import Frustum
from tests.render.conftest import camera

COORDINATES = st.floats(-60, 60)


@given(COORDINATES, COORDINATES, COORDINATES, st.floats(0.01, 20), st.integers(0, 2**31))
def test_a_sphere_with_a_visible_point_is_never_culled(x: float, y: float, z: float, radius: float, seed: int) -> None:
    record, centre = camera(), np.array([x, y, z])
    rng = np.random.Generator(np.random.PCG64(seed))
    offsets = rng.normal(size=(64, 3))
    points = centre + radius * rng.random((64, 1)) * offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
    in_camera = record.world_from_camera_transform.inverse().apply(points)
    ahead = in_camera[in_camera[:, 2] > 0.1]
    pixels = record.intrinsics.project(ahead)
    inside = (np.abs(pixels - (79.5, 47.5)) < (80, 48)).all(axis=1)
    if inside.any():
        assert in_frustum(Frustum.of(record), centre[None], np.array([radius]))[0]


def test_what_lies_behind_and_beside_is_culled() -> None:
    frustum = Frustum.of(camera(yaw_deg=0))
    centres = np.array([[10.0, 0, 1], [-5, 0, 1], [10, 30, 1], [10, -30, 1], [10, 0, 30], [10, 30, 1]])
    radii = np.array([1.0, 1, 1, 1, 1, np.inf])
    assert in_frustum(frustum, centres, radii).tolist() == [True, False, False, False, False, True]


def test_a_beam_holds_what_its_light_meets() -> None:
    centres = np.array([[0.0, 0, 500], [0, 0, -500], [13, 0, 0], [20, 0, 0], [20, 0, 0]])
    radii = np.array([1.0, 1, 1, 1, 7])
    inside = in_beam(np.zeros(3), np.array([0, 0, -2.0]), 10.0, centres, radii)
    assert inside.tolist() == [True, True, True, False, True]


@given(COORDINATES, COORDINATES, COORDINATES, st.floats(0.01, 20), st.integers(0, 2**31))
def test_a_sphere_that_shadows_a_visible_place_is_never_culled(
    x: float, y: float, z: float, radius: float, seed: int
) -> None:
    record, centre = camera(), np.array([x, y, z])
    frustum = Frustum.of(record)
    rng = np.random.Generator(np.random.PCG64(seed))
    towards_sun = rng.normal(size=3) + np.array((0.0, 0.0, 2.0))
    towards_sun /= np.linalg.norm(towards_sun)
    aside = np.cross(towards_sun, (0.0, 1.0, 0.0))
    aside /= np.linalg.norm(aside)
    axes = np.stack([aside, np.cross(towards_sun, aside), towards_sun])
    corners = frustum.slice_corners(5.0, 30.0)
    shares = rng.dirichlet(np.full(8, 0.3), size=256)
    away = centre - shares @ corners
    along = away @ towards_sun
    beside = np.linalg.norm(away - along[:, None] * towards_sun, axis=1)
    if ((beside < radius) & (along > 0)).any():
        assert may_shadow(corners, axes, 0.0, centre[None], np.array([radius]))[0]


def test_what_casts_its_shadow_elsewhere_is_culled() -> None:
    corners = Frustum.of(camera(yaw_deg=0)).slice_corners(5.0, 30.0)
    up = np.eye(3)
    centres = np.array([[20.0, 0, 80], [20, 0, -80], [-5, 0, 40], [60, 0, 40], [20, 50, 40], [20, 50, 40]])
    radii = np.array([1.0, 1, 1, 1, 1, np.inf])
    assert may_shadow(corners, up, 0.5, centres, radii).tolist() == [True, False, False, False, False, True]
    assert may_shadow(corners, up, 10.0, np.array([[-4.0, 0, 40]]), np.ones(1)).all(), "the margin counts"
