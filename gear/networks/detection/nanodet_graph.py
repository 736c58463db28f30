"""The torch module of NanoDet-g: a CSP backbone, a path aggregation network (PAN) and one head for each scale.

It follows the published configuration `nanodet-g` (RangiLyu/nanodet, Apache-2.0): 3.8 million parameters, trained on
COCO's photographs. Batch normalisation is folded into the convolutions, as in the published graph files.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

CLASSES = 80
BINS = 11
"""Number of bins of the distribution that the head predicts for each side of a box; bin k means k strides."""

STRIDES_PX = (8, 16, 32)
CHANNELS = 128
STEM_CHANNELS = 32
STAGES = ((32, 1, 1), (64, 2, 2), (128, 2, 2), (256, 3, 2))
"""Input channels, number of residual blocks and stride of the four CSP stages; a stage doubles the channels."""

SLOPE = 0.1
"""Negative slope of the activation (leaky ReLU)."""


class Convolution(nn.Module):
    """A 3 × 3 convolution with bias and leaky ReLU. The attribute is named `conv`, as in the published weights.

    Args:
        inputs, outputs: numbers of channels.
        stride: stride in both directions.
    """

    def __init__(self, inputs: int, outputs: int, stride: int = 1) -> None:
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, 3, stride, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, outputs, H / stride, W / stride)."""
        return functional.leaky_relu(self.conv(features), SLOPE)


class ResidualBlock(nn.Module):
    """Two convolutions; the result is both outputs side by side.

    Args:
        channels: number of channels of input and output.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.in_conv = Convolution(channels, channels // 2)
        self.mid_conv = Convolution(channels // 2, channels // 2)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, channels, H, W) to other features of the same shape."""
        first = self.in_conv(features)
        return torch.cat((self.mid_conv(first), first), dim=1)


class CspStage(nn.Module):
    """A cross stage partial stage (Wang et al., CSPNet, 2020): residual blocks beside a direct connection.

    Args:
        channels: number of channels of the input; the output has twice as many.
        blocks: number of residual blocks.
        stride: stride of the first convolution.
    """

    def __init__(self, channels: int, blocks: int, stride: int) -> None:
        super().__init__()
        self.in_conv = Convolution(channels, channels, stride)
        self.res_blocks = nn.Sequential(*(ResidualBlock(channels) for _ in range(blocks)))
        self.res_out_conv = Convolution(channels, channels)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, channels, H, W) to (B, 2 channels, H / stride, W / stride)."""
        first = self.in_conv(features)
        return torch.cat((self.res_out_conv(self.res_blocks(first)), first), dim=1)


class CspBackbone(nn.Module):
    """The backbone; its outputs are the feature maps at 1/8, 1/16 and 1/32 of the input's sides."""

    def __init__(self) -> None:
        super().__init__()
        stem = (Convolution(3, STEM_CHANNELS, 2), nn.MaxPool2d(3, 2, padding=1))
        self.stages = nn.ModuleList([*stem, *(CspStage(*stage) for stage in STAGES)])

    def forward(self, pictures: Tensor) -> list[Tensor]:
        """Converts normalised `pictures` (B, 3, H, W) to three maps with 128, 256 and 512 channels, finest first."""
        features, maps = pictures, []
        for stage in self.stages:
            features = stage(features)
            maps.append(features)
        return maps[-len(STRIDES_PX) :]


class LateralConvolution(nn.Module):
    """A 1 × 1 convolution to 128 channels with bias, without activation.

    Args:
        inputs: number of channels of the input.
    """

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.conv = nn.Conv2d(inputs, CHANNELS, 1)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, 128, H, W)."""
        result: Tensor = self.conv(features)
        return result


class Pan(nn.Module):
    """A path aggregation network (Liu et al., PANet, 2018) without convolutions between the scales."""

    def __init__(self) -> None:
        super().__init__()
        self.lateral_convs = nn.ModuleList(LateralConvolution(2 * stage[0]) for stage in STAGES[1:])

    def forward(self, maps: Sequence[Tensor]) -> list[Tensor]:
        """Converts the backbone's three `maps`, finest first, to three maps of the same sizes with 128 channels."""
        levels = [lateral(each) for lateral, each in zip(self.lateral_convs, maps, strict=True)]
        for coarse in range(len(levels) - 1, 0, -1):
            levels[coarse - 1] = levels[coarse - 1] + _resized(levels[coarse], 2.0)
        for fine in range(len(levels) - 1):
            levels[fine + 1] = levels[fine + 1] + _resized(levels[fine], 0.5)
        return levels


class Head(nn.Module):
    """One convolution and one 1 × 1 convolution for each scale; classes and boxes share both."""

    def __init__(self) -> None:
        super().__init__()
        # One convolution for each scale, in a sequence of its own, as in the published weights.
        self.cls_convs = nn.ModuleList(nn.Sequential(Convolution(CHANNELS, CHANNELS)) for _ in STRIDES_PX)
        self.gfl_cls = nn.ModuleList(nn.Conv2d(CHANNELS, CLASSES + 4 * BINS, 1) for _ in STRIDES_PX)

    def forward(self, maps: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        """Computes class logits (B, N, 80) and box logits (B, N, 4, 11) of all N cells, the finest scale first, by
        rows.

        Args:
            maps: the three maps of the path aggregation network (`Pan`), finest first, 128 channels each.
        """
        outputs = []
        for features, convolution, last in zip(maps, self.cls_convs, self.gfl_cls, strict=True):
            outputs.append(last(convolution(features)).flatten(2))
        cells = torch.cat(outputs, dim=2).transpose(1, 2)
        return cells[..., :CLASSES], cells[..., CLASSES:].reshape(*cells.shape[:2], 4, BINS)


class NanoDetGraph(nn.Module):
    """NanoDet-g: pictures to class logits and box logits of all cells."""

    def __init__(self) -> None:
        super().__init__()
        self.backbone = CspBackbone()
        self.fpn = Pan()
        self.head = Head()

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Runs the network.

        Args:
            pictures: (B, 3, H, W) normalised BGR pictures; H and W are multiples of 32.

        Returns:
            Class logits (B, N, 80) and box logits (B, N, 4, 11) for the left, top, right and bottom sides.
        """
        result: tuple[Tensor, Tensor] = self.head(self.fpn(self.backbone(pictures)))
        return result


def _resized(features: Tensor, scale: float) -> Tensor:
    return functional.interpolate(features, scale_factor=scale, mode="bilinear", align_corners=False)
