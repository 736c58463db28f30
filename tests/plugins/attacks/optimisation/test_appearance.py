"""Each change of a patch's look on its own."""

from __future__ import annotations

from typing import Any

import pytest
import torch
from torch import Tensor

from gear.plugins.attacks.optimisation.appearance import vary
from gear.plugins.attacks.optimisation.settings import Appearance
from gear.values.rng import derive_rng

PLAIN = {"noise": 0.0, "brightness": 0.0, "contrast": 0.0, "blur_px": 0}


def looks(patch: Tensor, count: int = 200, **options: Any) -> Tensor:
    return torch.stack([vary(Appearance(**PLAIN | options), patch, derive_rng(0, "look", n)) for n in range(count)])


def test_noise_is_on_every_value_on_its_own() -> None:
    seen = looks(torch.full((3, 20, 30), 0.5), 5, noise=0.1)
    assert float(seen.std()) == pytest.approx(0.1, rel=0.05) and float(seen.mean()) == pytest.approx(0.5, abs=0.01)


def test_brightness_is_one_number_added_to_all() -> None:
    seen = looks(torch.tensor([0.4, 0.5, 0.6]).view(3, 1, 1).expand(3, 2, 2), brightness=0.05)
    shifts = seen - torch.tensor([0.4, 0.5, 0.6]).view(3, 1, 1)
    assert float((shifts - shifts[:, :1, :1, :1]).abs().max()) < 1e-6
    assert float(shifts.std()) == pytest.approx(0.05, rel=0.2) and abs(float(shifts.mean())) < 0.01


def test_contrast_is_one_factor_on_all() -> None:
    colours = torch.tensor([0.2, 0.4, 0.6]).view(3, 1, 1)
    factors = looks(colours.expand(3, 2, 2), contrast=0.1) / colours
    assert float((factors - factors[:, :1, :1, :1]).abs().max()) < 1e-5
    assert float(factors.std()) == pytest.approx(0.1, rel=0.2) and float(factors.mean()) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize(("blur_px", "sides"), [(5, {3, 4, 5}), (3, {3}), (2, {1})])
def test_blur_is_a_box_of_three_to_so_many_pixels(blur_px: int, sides: set[int]) -> None:
    dot = torch.zeros(3, 11, 15)
    dot[:, 5, 7] = 1.0
    seen = looks(dot, 40, blur_px=blur_px)
    assert {round(float((one[0] > 0).sum()) ** 0.5) for one in seen} == sides
    assert torch.allclose(seen.sum(dim=(2, 3)), torch.ones(()), atol=1e-5)


def test_looks_stay_within_what_a_picture_can_show() -> None:
    seen = looks(torch.rand(3, 6, 6, generator=torch.Generator().manual_seed(0)), noise=1.0, brightness=1.0)
    assert float(seen.min()) == 0 and float(seen.max()) == 1
