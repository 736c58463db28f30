"""Puddles: on open ground, fixed to the town, linear, and with more reflection at a grazing angle."""

from __future__ import annotations

import numpy as np
import pytest

from gear.camera.water import Water
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.scene import CameraRecord, Pose

SIZE = (96, 160)


def camera(x_m: float = 0.0) -> CameraRecord:
    pose = RigidTransform.from_parts("world", "camera", CAMERA_FROM_ACTOR_AXES.T, (x_m, 0, 1.6))
    return CameraRecord(
        name="c", width_px=SIZE[1], height_px=SIZE[0], focal_px=90.0, world_from_camera=Pose.from_transform(pose)
    )


def frames(seed: int = 2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    patch = np.random.default_rng(seed).integers(0, LINEAR_FULL_SCALE + 1, (*SIZE, 3)).astype(np.uint16)
    return np.zeros_like(patch), np.full_like(patch, LINEAR_FULL_SCALE), patch


def ground_depth() -> np.ndarray:
    """Planar z of the plane z = 0; nothing above the horizon."""
    rows = (np.arange(SIZE[0]) - (SIZE[0] - 1) / 2) / 90.0
    depth = np.where(rows > 0.02, 1.6 / np.maximum(rows, 0.02), np.nan)
    return np.repeat(depth[:, None], SIZE[1], axis=1).astype(np.float32)


def puddles(share: float = 0.4, ripples: float = 0.0) -> Water:
    mirrored = np.zeros((16, 64, 3), np.float32)
    mirrored[..., 2] = np.linspace(1, 0, 16)[:, None]
    return Water(town="x", share=share, ripples=ripples, mirrored=mirrored)


def test_puddles_lie_on_open_ground_where_the_town_has_them() -> None:
    depth = ground_depth()
    _, white, _ = frames()
    ground = ~np.isnan(depth)
    seen = puddles().apply(white, depth, ground, camera())
    wet = (seen != white).any(axis=-1)
    assert 0.1 < wet[ground].mean() < 0.8 and not wet[~ground].any()
    assert np.array_equal(puddles(0.0).apply(white, depth, ground, camera()), white)


@pytest.mark.parametrize(("moved_m", "least_alike"), [(2.0, 0.9), (0.0, 1.0)])
def test_a_camera_that_has_moved_sees_the_same_water_elsewhere(moved_m: float, least_alike: float) -> None:
    depth, (_, white, _) = ground_depth(), frames()
    x_m, y_m = (grid.reshape(-1) for grid in np.meshgrid(np.linspace(6, 9, 30), np.linspace(-2, 2, 9)))
    seen = []
    for at_m in (0.0, moved_m):
        wet = (puddles().apply(white, depth, ~np.isnan(depth), camera(at_m)) != white).any(axis=-1)
        row = np.rint(90 * 1.6 / (x_m - at_m) + (SIZE[0] - 1) / 2).astype(int)
        column = np.rint(-90 * y_m / (x_m - at_m) + (SIZE[1] - 1) / 2).astype(int)
        seen.append(wet[row, column])
    assert 0.15 < seen[0].mean() < 0.85
    assert (seen[0] == seen[1]).mean() >= least_alike


def test_water_mirrors_more_at_a_flat_angle() -> None:
    depth = ground_depth()
    black, _, _ = frames()
    seen = puddles(share=1.1).apply(black, depth, ~np.isnan(depth), camera())
    blue = seen[..., 2].mean(axis=1)
    horizon = int(np.argmax(~np.isnan(depth[:, 0])))
    assert blue[horizon] > 5 * blue[-1] > 0
    assert (np.diff(blue[horizon:]) <= 0.5).all()


def test_linear_in_the_picture() -> None:
    depth = ground_depth()
    black, white, patch = (
        puddles(ripples=0.5).apply(picture, depth, ~np.isnan(depth), camera()).astype(float) for picture in frames()
    )
    expected = black + frames()[2] / LINEAR_FULL_SCALE * (white - black)
    assert np.abs(patch - expected).max() <= 1.5
    assert np.abs(patch - frames()[2]).max() > 50
