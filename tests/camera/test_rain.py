"""Rain: seeded, in front of what is far, and linear."""

from __future__ import annotations

import numpy as np

from gear.camera.rain import Rain
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord, Pose

SIZE = (96, 160)


RAIN = Rain.of(80, 40, np.array([0.6, 0.7, 0.8]))


STILL = (0.0, 0.0, 0.0)


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


def test_the_same_sample_has_the_same_drops_and_another_has_others() -> None:
    depth = np.full(SIZE, 50, np.float32)
    first, again, other = (RAIN.cover(depth, camera(), STILL, derive_rng(7, "rain", i)) for i in (0, 0, 1))
    assert np.array_equal(first, again)
    assert (first != other).mean() > 0.05
    assert 0.005 < first.mean() < 0.2
    assert first.min() >= 0 and first.max() <= 1


def test_drops_fall_before_things_and_not_behind_them() -> None:
    depth = np.full(SIZE, 50, np.float32)
    depth[:, :80] = 0.5
    cover = RAIN.cover(depth, camera(), STILL, derive_rng(7, "rain", 0))
    assert (cover[:, :80] == 0).all() and cover[:, 80:].mean() > 0.005


def test_streaks_stand_up_and_lean_when_the_car_passes_sideways() -> None:
    depth = np.full(SIZE, 50, np.float32)
    calm = Rain.of(80, 0, np.ones(3))
    down = calm.cover(depth, camera(), STILL, derive_rng(7, "rain", 0))
    across = calm.cover(depth, camera(), (0.0, 30.0, 0.0), derive_rng(7, "rain", 0))
    ratios = [np.abs(np.diff(c, axis=1)).sum() / np.abs(np.diff(c, axis=0)).sum() for c in (down, across)]
    assert ratios[0] > 1.3 > 0.8 > ratios[1]


def test_streaks_lean_against_the_way_that_the_car_goes() -> None:
    """Passing to the left, drops come down to the right."""
    depth = np.full(SIZE, 50, np.float32)
    leans = []
    for left_mps in (6.0, -6.0):
        cover = Rain.of(80, 0, np.ones(3)).cover(depth, camera(), (0.0, left_mps, 0.0), derive_rng(7, "rain", 0))
        down, right = np.gradient(cover)
        leans.append(-(down * right).sum() / (right**2).sum())
    assert leans[0] > 0.1 and leans[1] < -0.1


def test_more_rain_covers_more_and_none_nothing() -> None:
    depth = np.full(SIZE, 50, np.float32)
    covers = [
        Rain.of(p, 0, np.ones(3)).cover(depth, camera(), STILL, derive_rng(1, "rain", 0)).mean() for p in (10, 100)
    ]
    assert covers[0] < 0.5 * covers[1]
    picture = frames()[2]
    dry = Rain.of(0, 50, np.ones(3)).apply(picture, depth, camera(), STILL, derive_rng(1, "rain", 0))
    assert np.array_equal(dry, picture)


def test_linear_in_the_picture() -> None:
    depth = ground_depth()
    black, white, patch = (
        RAIN.apply(picture, depth, camera(), STILL, derive_rng(7, "rain", 0)).astype(float) for picture in frames()
    )
    expected = black + frames()[2] / LINEAR_FULL_SCALE * (white - black)
    assert np.abs(patch - expected).max() <= 1.5
    assert np.abs(patch - frames()[2]).max() > 50
