"""Smoothness and the printable palette."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import torch

from gear.camera.response import decode_srgb
from gear.plugins.attacks.optimisation.regularisers import non_printability, palette_srgb, smoothness


def test_smoothness_is_a_sum_of_squares() -> None:
    assert smoothness(torch.full((3, 4, 5), 0.3)) == 0
    patch = torch.zeros(3, 2, 3)
    patch[1, 0, 1] = 0.5
    assert torch.isclose(smoothness(patch), torch.tensor(3 * 0.25))


def test_the_palette_is_that_of_a_press() -> None:
    palette = (255 * palette_srgb()).round().int()
    assert len({tuple(colour) for colour in palette.tolist()}) == 27
    paper, yellow, red, black = palette[0], palette[2], palette[8], palette[26]
    assert paper.min() > 230, "no ink is paper"
    assert yellow[:2].min() > 215 and yellow[2] < 60
    assert red[0] > 190 and red[1:].max() < 70
    assert black.max() < 80, "three inks on each other are nearly black"
    assert palette_srgb().min() >= 0 and palette_srgb().max() <= 1


@pytest.mark.parametrize(
    ("number", "lab"),
    [(0, (95, 0, -2)), (6, (48, 74, -3)), (8, (47, 68, 48)), (26, (23, 0, 0))],
)
def test_solids_have_the_standards_colours(number: int, lab: tuple[float, float, float]) -> None:
    """Paper, magenta, red and black of ISO 12647-2. OpenCV's Lab is under another white, hence a few units."""
    found = cv2.cvtColor(palette_srgb()[None].numpy(), cv2.COLOR_RGB2Lab)[0, number]
    np.testing.assert_allclose(found, lab, atol=5)


def test_half_a_cover_is_half_the_light() -> None:
    light = decode_srgb(palette_srgb().numpy())
    for half, solid in ((3, 6), (1, 2)):
        inside = (light[[half, solid]] > 0.001).all(axis=0)
        np.testing.assert_allclose(light[half, inside], (light[0] + light[solid])[inside] / 2, atol=1e-3)


def test_what_can_be_printed_costs_nothing() -> None:
    palette = palette_srgb()
    patch = palette[torch.from_numpy(np.random.default_rng(0).integers(0, 27, (6, 7)))].permute(2, 0, 1)
    assert non_printability(patch) < 1e-3
    off = torch.tensor([0.0, 1.0, 0.0]).view(3, 1, 1).expand(3, 6, 7).clone().requires_grad_(True)
    cost = non_printability(off)
    assert cost > 42 * 0.2, "screen green lies outside of what inks can do"
    (gradient,) = torch.autograd.grad(cost, off)
    assert torch.isfinite(gradient).all() and gradient.abs().sum() > 0
