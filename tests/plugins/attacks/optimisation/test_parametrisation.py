"""The parametrisation of free pixels."""

from __future__ import annotations

import torch

from gear.plugins.attacks.optimisation.parametrisation import Pixels
from gear.values.rng import derive_rng


def test_pixels_are_their_own_parameters() -> None:
    pixels = Pixels(4, 8)
    first = pixels.first(2, derive_rng(0, "pixels"))
    assert first.shape == pixels.shape(2) == (2, 3, 4, 8)
    assert 0 <= float(first.min()) < 0.1 and 0.9 < float(first.max()) <= 1
    assert pixels.textures(first) is first
    assert pixels.projected(torch.tensor([-1.0, 0.5, 2.0])).tolist() == [0.0, 0.5, 1.0]
