"""Xception39, the context path of BiSeNet."""

from __future__ import annotations

import torch

from gear.networks.segmentation.xception39 import STAGES, Block, ConvBnRelu, Separable, Xception39


def test_features_have_the_stated_scales_and_channels() -> None:
    graph = Xception39().eval()
    with torch.no_grad():
        eighth, sixteenth, last = graph(torch.zeros(1, 3, 64, 96))
    assert eighth.shape == (1, 64, 8, 12)
    assert sixteenth.shape == (1, 128, 4, 6)
    assert last.shape == (1, 256, 2, 3)
    assert [len(stage) for stage in (graph.layer1, graph.layer2, graph.layer3)] == [count for _, count in STAGES]


def test_the_depth_wise_convolution_keeps_channels_apart() -> None:
    layer = Separable(4, 6)
    assert layer.conv1.groups == 4
    assert layer(torch.zeros(1, 4, 8, 8)).shape == (1, 6, 8, 8)


def test_normalisation_and_relu_are_optional() -> None:
    torch.manual_seed(0)
    noise = torch.randn(1, 3, 8, 8)
    assert ConvBnRelu(3, 5, 3)(noise).min() >= 0
    bare = ConvBnRelu(3, 5, 3, norm=False, rectify=False)
    assert bare.bn is None
    torch.testing.assert_close(bare(noise), bare.conv(noise))


def test_a_block_projects_its_shortcut_only_when_it_strides() -> None:
    assert Block(8, 2, 1).proj is None
    assert Block(8, 2, 2).proj is not None
    assert Block(8, 2, 2)(torch.zeros(1, 8, 8, 8)).shape == (1, 8, 4, 4)
