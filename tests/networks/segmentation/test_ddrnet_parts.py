"""Building blocks of DDRNet."""

from __future__ import annotations

import pytest
import torch

from gear.networks.segmentation.ddrnet_parts import (
    BasicBlock,
    Bottleneck,
    Dappm,
    Head,
    shortcut,
    stage,
    upsample,
)


@pytest.fixture
def features() -> torch.Tensor:
    return torch.randn(2, 8, 16, 24, generator=torch.Generator().manual_seed(1))


def test_a_shortcut_is_a_projection_only_where_sizes_differ() -> None:
    assert shortcut(8, 8, 1) is None
    for inputs, outputs, stride in ((8, 16, 1), (8, 8, 2)):
        layer = shortcut(inputs, outputs, stride)
        assert layer is not None
        assert layer(torch.zeros(1, inputs, 4, 4)).shape == (1, outputs, 4 // stride, 4 // stride)


@pytest.mark.parametrize("stride", [1, 2])
def test_blocks_have_the_stated_shapes(features: torch.Tensor, stride: int) -> None:
    assert BasicBlock(8, 12, stride)(features).shape == (2, 12, 16 // stride, 24 // stride)
    assert Bottleneck(8, 6, stride)(features).shape == (2, 12, 16 // stride, 24 // stride)
    assert Head(8, 6, 19)(features).shape == (2, 19, 16, 24)


def test_a_sum_is_rectified_only_on_request(features: torch.Tensor) -> None:
    torch.manual_seed(0)
    assert BasicBlock(8, 8)(features).min() >= 0
    assert BasicBlock(8, 8, rectify=False)(features).min() < 0
    assert stage(8, 8)(features).min() < 0
    assert Bottleneck(8, 4)(features).min() < 0


def test_without_weights_a_block_is_the_identity(features: torch.Tensor) -> None:
    block = BasicBlock(8, 8, rectify=False).eval()
    torch.nn.init.zeros_(block.bn2.weight)
    torch.testing.assert_close(block(features.clone()), features)


def test_every_scale_of_the_pooling_reaches_the_output(features: torch.Tensor) -> None:
    torch.manual_seed(0)
    pooling = Dappm(8, 4, 10).eval()
    whole = pooling(features)
    assert whole.shape == (2, 10, 16, 24)
    far = features.clone()
    far[..., 0, 0] += 100  # seen from everywhere by the scale that averages the whole map
    assert (pooling(far) - whole)[..., -1, -1].abs().max() > 0


def test_upsampling_does_not_align_corners() -> None:
    found = upsample(torch.tensor([[[[0.0, 4.0]]]]), torch.zeros(1, 1, 1, 4))
    assert found.flatten().tolist() == [0.0, 1.0, 3.0, 4.0]
