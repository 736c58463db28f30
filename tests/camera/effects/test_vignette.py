"""Vignette: how much the corners lose, and the torch twin."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from gear.camera.effects.vignette import Vignette, vignette_map
from tests.camera.effects.scenes import HEIGHT, WIDTH, exposure, raw


def test_a_vignette_darkens_corners_by_its_strength() -> None:
    share = vignette_map(0.4, WIDTH, HEIGHT)
    assert share[0, 0] == pytest.approx(0.6, abs=1e-3) == pytest.approx(share[-1, -1], abs=1e-3)
    assert share.max() == pytest.approx(1, abs=1e-3) and share[HEIGHT // 2, WIDTH // 2] > 0.999
    assert share[HEIGHT // 2, 0] < share[0, WIDTH // 2], "the sides lie farther out than top and bottom"


def test_the_torch_twin_is_the_same_without_rounding() -> None:
    colour = np.random.default_rng(3).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    light = torch.from_numpy(colour.astype(np.float64)).permute(2, 0, 1)[None]
    dimmed = Vignette(vignette=0.4).apply_torch(light, raw(), exposure())[0].permute(1, 2, 0).numpy()
    expected = Vignette(vignette=0.4).apply(raw(colour), exposure()).linear_rgb
    assert expected is not None
    assert np.abs(dimmed - expected).max() <= 0.51
    assert dimmed[0, 0, 0] < 0.7 * colour[0, 0, 0]
