"""The base of depth networks: input size, outputs, losses."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.networks.depth.network import DepthNetwork, resized
from gear.networks.depth.options import DepthOptions
from gear.plugins.tasks.depth import VIEW


class Constant(DepthNetwork):
    """Predicts 7 m, and records the sizes that it is given."""

    multiple_px: ClassVar[int] = 8
    least_px: ClassVar[int] = 16

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        self.size = tuple(picture.shape[2:])
        return {"depth_m": torch.full((len(picture), *(side // 2 for side in self.size)), 7.0)}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        return {"error": (outputs["depth_m"] - depth_m).abs().mean()}


@pytest.mark.parametrize(
    ("scale", "size", "seen"), [(1.0, (40, 70), (40, 72)), (0.5, (48, 70), (24, 32)), (0.1, (40, 70), (16, 16))]
)
def test_the_input_is_a_multiple_and_the_depth_has_the_picture_size(
    scale: float, size: tuple[int, int], seen: tuple[int, int]
) -> None:
    network = Constant(nn.Identity(), DepthOptions(weights="none", input_scale=scale))
    depth_m = network.run({VIEW: torch.rand(2, 3, *size)})["depth_m"]
    assert network.size == seen
    assert depth_m.shape == (2, *size)
    assert torch.allclose(depth_m, torch.tensor(7.0))


def test_the_default_scale_is_used_where_the_options_state_none() -> None:
    assert Constant(nn.Identity(), DepthOptions(weights="none"), input_scale=0.25).input_scale == 0.25
    assert Constant(nn.Identity(), DepthOptions(weights="none", input_scale=2.0), input_scale=0.25).input_scale == 2.0


def test_losses_and_predictions_use_the_samples() -> None:
    network = Constant(nn.Identity(), DepthOptions(weights="none"))
    outputs = network.run({VIEW: torch.rand(1, 3, 16, 16)})
    target = SimpleNamespace(depth_m=np.full((16, 16), 5, np.float32))
    assert float(network.losses(outputs, [target])["error"]) == pytest.approx(2.0)
    (found,) = network.predictions(outputs, (16, 16))
    assert found.dtype == np.float32
    assert (found == 7).all()


def test_resizing_to_the_same_size_copies_nothing() -> None:
    maps = torch.rand(1, 2, 4, 6)
    assert resized(maps, 4, 6) is maps
    assert resized(torch.ones(1, 1, 4, 4), 2, 8).shape == (1, 1, 2, 8)
    assert float(resized(torch.tensor([[[[0.0, 0.0, 4.0, 4.0]]]]), 1, 1)) == pytest.approx(2.0)
