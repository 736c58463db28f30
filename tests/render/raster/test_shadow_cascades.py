"""Shadow maps cover what the camera sees, and the town."""

from __future__ import annotations

import numpy as np

from gear.render.pinhole import Frustum
from gear.render.raster.shadow_cascades import CASCADE_ENDS_M, town_cascade, view_cascades
from tests.render.conftest import camera


def test_shadows_are_looked_for_wherever_the_camera_looks() -> None:
    record = camera(320, 192)
    sun = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    cascades = view_cascades(Frustum.of(record), sun)
    columns, rows = np.meshgrid([-0.5, 319.5], [-0.5, 191.5])
    corners = np.stack([columns, rows], axis=-1).reshape(-1, 2)
    begin_m = 0.1
    for cascade, end_m in zip(cascades, CASCADE_ENDS_M, strict=True):
        for depth_m in (begin_m, end_m):
            points = record.world_from_camera_transform.apply(record.intrinsics.unproject(corners, np.full(4, depth_m)))
            placed = np.concatenate([points, np.ones((4, 1))], axis=1) @ cascade.matrix(np.zeros(3)).T
            assert (np.abs(placed[:, :2]) <= 1 + 1e-9).all() and ((placed[:, 2] >= 0) & (placed[:, 2] <= 1)).all()
        begin_m = end_m
    nearer, farther = (cascades[0].matrix(np.zeros(3)) @ [*point, 1.0] for point in (2 * sun, 0 * sun))
    assert nearer[2] < farther[2], "depth grows away from the sun"
    assert np.allclose(nearer[:2], farther[:2])


def test_a_town_is_in_one_square_but_for_what_lies_far_outside() -> None:
    points = np.random.default_rng(0).uniform(-100, 100, (1000, 3)) * [1, 1, 0.1]
    points[0] = (1e5, 0, 0)
    cascade = town_cascade(points, np.array([0.0, 0.6, 0.8]))
    assert 90 < cascade.half_side_m < 110
