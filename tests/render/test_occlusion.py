"""Ambient occlusion from depth."""

from __future__ import annotations

import numpy as np

from gear.render.occlusion import STRENGTH, openness, shade
from gear.values.geometry import Intrinsics

CAMERA = Intrinsics(320, 160, 200.0)


def depth_of_planes(*planes: tuple[tuple[float, float, float], float]) -> np.ndarray:
    """Planar z of the nearest of some planes n · p = d in the camera's frame, NaN where none is ahead."""
    columns, rows = np.meshgrid(np.arange(CAMERA.width_px), np.arange(CAMERA.height_px))
    rays = CAMERA.unproject(np.stack([columns, rows], axis=-1), np.ones(columns.shape))
    depth = np.full(columns.shape, np.inf)
    for normal, offset in planes:
        with np.errstate(divide="ignore"):
            z = offset / (rays @ np.array(normal))
        depth = np.minimum(depth, np.where((z > 0) & (z < 80), z, np.inf))
    return np.where(np.isfinite(depth), depth, np.nan).astype(np.float32)


def test_planes_are_open_whatever_their_slant() -> None:
    for normal in ((0.0, 1.0, 0.0), (0.3, 0.2, 1.0), (0.0, 0.0, 1.0), (1.0, 0.1, 0.3)):
        seen = openness(depth_of_planes((normal, 1.6)), CAMERA.focal_px)
        inside = np.isfinite(depth_of_planes((normal, 1.6)))
        inside[:10] = inside[-10:] = inside[:, :10] = inside[:, -10:] = False
        assert np.quantile(seen[inside], 0.02) > 0.97, normal
        assert seen.min() >= 1 - STRENGTH and seen.max() <= 1


def test_corners_are_darker_than_what_is_around_them() -> None:
    # Ground 1.6 m below the camera, a wall 6 m ahead: they meet at row 79.5 + 200 * 1.6 / 6.
    seen = openness(depth_of_planes(((0, 1, 0), 1.6), ((0, 0, 1), 6.0)), CAMERA.focal_px)
    corner = round(79.5 + 200 * 1.6 / 6)
    column = seen[:, 160]
    assert column[corner - 2 : corner + 3].min() < 0.9
    assert column[corner - 45] > 0.98 and column[corner + 20] > 0.97
    assert abs(int(np.argmin(column[80:150])) + 80 - corner) <= 4


def test_an_object_before_a_distant_wall_casts_no_halo() -> None:
    depth = np.full((160, 320), 30.0, np.float32)
    depth[60:100, 140:180] = 5.0
    seen = openness(depth, CAMERA.focal_px)
    assert seen[20:140, 100:130].min() > 0.98
    assert openness(np.full((160, 320), np.nan, np.float32), CAMERA.focal_px).min() == 1


def test_shading_multiplies_and_rounds() -> None:
    light = np.arange(0, 1020, 4, dtype=np.uint16).reshape(5, 17, 3)
    share = np.linspace(0.4, 1, 85, dtype=np.float32).reshape(5, 17)
    got = shade(light, share)
    assert got.dtype == np.uint16
    assert np.abs(got - light * share[..., None]).max() <= 0.5 + 1e-3
