"""Noise and reads of textures."""

from __future__ import annotations

import numpy as np
import pytest

from gear.camera.fractal import TILE_PX, periodic_noise, sampled, smooth_step


def test_noise_is_uniform_periodic_and_follows_its_generator() -> None:
    tile = periodic_noise(np.random.default_rng(1), (4, 8), slope=1.0)
    assert tile.shape == (TILE_PX, TILE_PX)
    assert tile.dtype == np.float32
    assert np.histogram(tile, 10, (0, 1))[0] == pytest.approx(TILE_PX**2 / 10, rel=0.001)
    inner = np.abs(np.diff(tile, axis=1)).max()
    assert np.abs(tile[:, 0] - tile[:, -1]).max() <= 2 * inner
    assert np.array_equal(tile, periodic_noise(np.random.default_rng(1), (4, 8), slope=1.0))
    assert not np.array_equal(tile, periodic_noise(np.random.default_rng(2), (4, 8), slope=1.0))


def test_reads_are_bilinear_and_repeat_or_stop_at_the_border() -> None:
    picture = np.arange(12, dtype=np.float32).reshape(3, 4)
    x, y = np.array([1.5, 0.0, 3.5, -1.0]), np.array([0.5, 2.0, 0.0, 0.0])
    assert sampled(picture, x, y).tolist() == [3.5, 8.0, 1.5, 3.0]
    assert sampled(picture, x, y, is_periodic=False).tolist() == [3.5, 8.0, 3.0, 0.0]
    many = sampled(np.dstack([picture, -picture]), np.full(9000, 2.0), np.full(9000, 1.0))
    assert many.shape == (9000, 2)
    assert (many == [6.0, -6.0]).all()


def test_a_smooth_step_rises_from_0_to_1() -> None:
    values = smooth_step(np.array([0.0, 2.0, 2.5, 3.0, 9.0], np.float32), edge=2.0, width=1.0)
    assert values.tolist() == [0.0, 0.0, 0.5, 1.0, 1.0]
