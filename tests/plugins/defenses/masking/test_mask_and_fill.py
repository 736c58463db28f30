"""The base class of defenses that locate and fill, with a defense that locates bright pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from gear.plugins.defenses.masking.mask_and_fill import Located, MaskAndFill
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.frames import UInt8Image


class Bright(MaskAndFill):
    def locate(self, picture: UInt8Image, state: Any) -> Located:
        return np.asarray(picture[..., 0] > 127, np.bool_)

    def locate_tensor(self, pictures: Tensor, state: Any) -> Tensor:
        return torch.sigmoid(40 * (pictures[:, 0] - 0.5))

    def fill(self, picture: UInt8Image, located: Located) -> UInt8Image:
        return np.where(located[..., None], np.uint8(51), picture)


def test_values_are_exact_and_gradients_those_of_the_soft_mask() -> None:
    shown = torch.zeros(1, 3, 1, 2)
    shown[0, 0, 0] = torch.tensor([0.52, 0.25])
    shown.requires_grad_(True)
    batch = Bright().defend_batch({"left": shown}, TinySegmenter(TinyConfig()), None)
    assert batch.masks is not None and batch.scores is not None
    assert batch.views["left"][0, 0, 0].tolist() == pytest.approx([0.2, 0.25])
    assert batch.scores.tolist() == pytest.approx([0.5])
    (of_view,) = torch.autograd.grad(batch.views["left"][0, 0, 0, 0], shown, retain_graph=True)
    soft = 1 / (1 + np.exp(-40 * 0.02))
    assert float(of_view[0, 0, 0, 0]) == pytest.approx((0.2 - 0.52) * 40 * soft * (1 - soft), rel=1e-4)
    (of_score,) = torch.autograd.grad(batch.scores.sum(), shown)
    assert float(of_score[0, 0, 0, 0]) == pytest.approx(40 * soft * (1 - soft) / 2, rel=1e-4)


def test_the_score_is_the_largest_share_of_a_camera() -> None:
    dark, half = np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4, 3), np.uint8)
    half[:2] = 200
    result = Bright().apply({"left": dark, "right": half}, None, None, np.random.default_rng(0))
    assert result.score == 0.5
    assert np.array_equal(result.views["right"][2:], half[2:]) and np.all(result.views["right"][:2] == 51)
