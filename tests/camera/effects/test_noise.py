"""Noise: repeatable, unbiased, of the given strength; its torch twins draw the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from gear.camera.effects.noise import Noise
from gear.values.frames import LINEAR_FULL_SCALE, UInt16Image
from tests.camera.effects.scenes import HEIGHT, WIDTH, exposure, raw

NOISE = Noise(shot_noise=4.0, read_noise=1.0)


def noisy(level: int, index: int = 0) -> UInt16Image:
    flat = np.full((HEIGHT, WIDTH, 3), level, np.uint16)
    shown = NOISE.apply(raw(flat), exposure(index=index)).linear_rgb
    assert shown is not None
    return shown


def test_noise_is_repeatable_unbiased_and_of_its_strength() -> None:
    first, again, other = noisy(510), noisy(510), noisy(510, index=1)
    assert np.array_equal(first, again) and (first != other).mean() > 0.9
    assert first.mean() == pytest.approx(510, abs=0.5)
    expected = math.sqrt(0.5 * 0.04**2 + 0.01**2) * LINEAR_FULL_SCALE
    assert first.astype(float).std() == pytest.approx(expected, rel=0.03)
    assert 0 < noisy(0).astype(float).std() < 0.4 * first.astype(float).std()


def test_torch_twins_have_the_same_noise() -> None:
    light = torch.full((1, 3, HEIGHT, WIDTH), 0.5, dtype=torch.float64, requires_grad=True)
    whole = NOISE.apply_torch(light, raw(), exposure())
    np.testing.assert_allclose(
        whole[0].permute(1, 2, 0).detach().numpy() * LINEAR_FULL_SCALE, noisy(510).astype(float), atol=0.51
    )
    rows, columns = np.array([3, 40, 95]), np.array([7, 0, 159])
    some = NOISE.torch_at((rows, columns), exposure(), light)(torch.full((3, 3), 0.5, dtype=torch.float64))
    torch.testing.assert_close(some, whole[0, :, rows, columns].T.detach())
    whole.sum().backward()
    assert light.grad is not None and bool(torch.isfinite(light.grad).all())
