"""Local entropy, against a plain loop over windows."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy import stats

from gear.plugins.defenses.masking.entropy import (
    grey_levels,
    soft_window_entropies,
    to_pixels,
    window_entropies,
    window_sides,
)


@pytest.mark.parametrize(
    ("size", "sides"),
    [((224, 224), (8, 12, 16)), ((375, 500), (8, 12, 16)), ((1024, 2048), (22, 34, 44)), ((352, 1216), (14, 22, 28))],
)
def test_window_sides_are_those_of_the_authors_code(size: tuple[int, int], sides: tuple[int, int, int]) -> None:
    assert window_sides(*size) == sides


@pytest.mark.parametrize("size", [(37, 53), (16, 24), (5, 9)])
def test_entropies_are_shannons_of_every_window(size: tuple[int, int]) -> None:
    grey = np.random.default_rng(1).integers(0, 40, size).astype(np.uint8)
    side = 8
    extended = np.pad(grey, side // 2, mode="symmetric")
    found = window_entropies(grey, side)
    for i, top in enumerate(range(0, size[0], side // 2)):
        for j, left in enumerate(range(0, size[1], side // 2)):
            window = extended[top : top + side + 1, left : left + side + 1]
            expected = stats.entropy(np.unique(window, return_counts=True)[1], base=2)
            assert found[i, j] == pytest.approx(expected, abs=1e-5)
    assert found.shape == (len(range(0, size[0], 4)), len(range(0, size[1], 4)))


def test_a_pixel_takes_the_value_of_the_window_whose_centre_is_nearest() -> None:
    values = np.arange(12, dtype=np.float32).reshape(3, 4)
    pixels = to_pixels(values, 10, 14, 8)
    for row in range(10):
        for column in range(14):
            near = [(row - 4 * i) ** 2 + (column - 4 * j) ** 2 for i in range(3) for j in range(4)]
            assert near[int(pixels[row, column])] == min(near)


def test_grey_levels_are_those_of_bt601() -> None:
    picture = np.random.default_rng(2).integers(0, 256, (20, 30, 3), dtype=np.uint8)
    assert np.abs(grey_levels(picture) - picture @ np.array([0.299, 0.587, 0.114])).max() <= 0.51


def test_soft_entropies_follow_the_exact_ones_and_have_gradients() -> None:
    rng = np.random.default_rng(3)
    picture = np.full((64, 96, 3), 90, np.uint8)
    picture[16:48, 32:64] = rng.integers(0, 256, (32, 32, 1))
    tensor = (torch.from_numpy(picture).permute(2, 0, 1)[None].float() / 255).requires_grad_(True)
    soft = soft_window_entropies(tensor, 8)
    exact = window_entropies(grey_levels(picture), 8)
    assert soft.shape[1:] == exact.shape
    assert np.corrcoef(soft[0].detach().numpy().ravel(), exact.ravel())[0, 1] > 0.95
    (gradient,) = torch.autograd.grad(soft.sum(), tensor)
    assert bool(torch.isfinite(gradient).all()) and float(gradient[..., 16:48, 32:64].abs().sum()) > 0


def test_following_the_soft_gradient_lowers_the_exact_entropy() -> None:
    picture = torch.from_numpy(np.random.default_rng(4).random((1, 3, 32, 32), np.float32))

    def exact(one: torch.Tensor) -> float:
        levels = (one[0].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
        return float(window_entropies(grey_levels(levels), 8).mean())

    shown = picture
    for _ in range(40):
        shown = shown.detach().requires_grad_(True)
        (gradient,) = torch.autograd.grad(soft_window_entropies(shown, 8).mean(), shown)
        shown = (shown.detach() - 0.02 * gradient.sign()).clamp(0, 1)
    assert exact(shown) < exact(picture) - 1
