"""AdaBins' head on EfficientNet-Lite0: what the encoder returns, and which parts learn."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from gear.networks.depth.adabins_lite0 import LiteAdaBins, LiteEncoder, adabins_lite0_graph
from gear.networks.depth.options import AdaBinsLite0Options
from gear.networks.runtime import seeded
from gear.networks.weights import build_graph

OPTIONS = AdaBinsLite0Options(weights="none", device="cpu", features=32, width=8, bins=12, queries=5, seed=2)


@pytest.fixture(scope="module")
def network() -> LiteAdaBins:
    return LiteAdaBins(build_graph(lambda: adabins_lite0_graph(OPTIONS), OPTIONS, "adabins_lite0"), OPTIONS)


def test_the_encoder_returns_the_ends_of_the_stages_at_each_resolution() -> None:
    with seeded(1):
        encoder = LiteEncoder().eval()
    body = encoder.lite0()
    seen: list[Tensor] = []
    for stage in (0, 1, 2, 4, 6):
        body.get_submodule(f"blocks.{stage}").register_forward_hook(lambda _m, _i, out: seen.append(out.clone()))
    with torch.no_grad():
        maps = encoder(torch.rand((1, 3, 64, 96), generator=torch.Generator().manual_seed(2)))
    assert [tuple(one.shape[1:]) for one in maps] == [
        (16, 32, 48), (24, 16, 24), (40, 8, 12), (112, 4, 6), (320, 2, 3),
    ]  # fmt: skip
    for one, other in zip(maps, seen, strict=True):
        torch.testing.assert_close(one, other)


def test_depth_has_the_size_of_the_picture_and_lies_in_the_range(network: LiteAdaBins) -> None:
    for size in ((40, 61), (370, 1224)):
        with torch.no_grad():
            outputs = network({"left": torch.rand((1, 3, *size), generator=torch.Generator().manual_seed(3))})
        assert outputs["depth_m"].shape == (1, *size) and outputs["bin_centres_m"].shape == (1, 12)
        assert float(outputs["depth_m"].min()) > 0 and float(outputs["depth_m"].max()) < OPTIONS.max_depth_m


def test_grey_127_is_zero_after_normalisation(network: LiteAdaBins) -> None:
    """The package of the ImageNet weights subtracts 127 and divides by 128."""
    grey = torch.full((1, 3, 2, 2), 127 / 255)
    assert float(network._normalise(grey).abs().max()) < 1e-6
    assert float(network._normalise(torch.ones(1, 3, 2, 2)).max()) == pytest.approx(1.0)


def test_the_loss_reaches_every_parameter(network: LiteAdaBins) -> None:
    network.train()
    generator = torch.Generator().manual_seed(4)
    depth_m = 2 + 40 * torch.rand((2, 96, 160), generator=generator)
    outputs = network.run_for_losses({"left": torch.rand((2, 3, 96, 160), generator=generator)})
    sum(network.depth_losses(outputs, depth_m).values(), torch.zeros(())).backward()
    without = [name for name, one in network.graph.named_parameters() if one.grad is None or not one.grad.any()]
    network.eval()
    assert without == []
