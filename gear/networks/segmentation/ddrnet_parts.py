"""Building blocks of DDRNet: residual blocks, deep aggregation pyramid pooling, heads (Hong et al., arXiv
2101.06085).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional


def conv3x3(inputs: int, outputs: int, stride: int = 1, *, bias: bool = False) -> nn.Conv2d:
    """A 3x3 convolution with padding 1.

    Args:
        inputs, outputs: numbers of channels.
        stride: stride in both directions.
        bias: whether the layer has a bias.
    """
    return nn.Conv2d(inputs, outputs, 3, stride, padding=1, bias=bias)


def conv1x1(inputs: int, outputs: int, stride: int = 1) -> nn.Conv2d:
    """A 1x1 convolution without bias.

    Args:
        inputs, outputs: numbers of channels.
        stride: stride in both directions.
    """
    return nn.Conv2d(inputs, outputs, 1, stride, bias=False)


def upsample(features: Tensor, like: Tensor) -> Tensor:
    """Resizes features bilinearly with `align_corners=False`.

    Args:
        features: (B, C, h, w).
        like: map (..., H, W) whose height and width the result gets.
    """
    return functional.interpolate(features, size=like.shape[2:], mode="bilinear", align_corners=False)


class BasicBlock(nn.Module):
    """Basic residual block: two 3x3 convolutions with a shortcut.

    Args:
        inputs: number of input channels.
        planes: number of channels of both convolutions and of the output.
        stride: stride of the first convolution.
        rectify: whether a ReLU follows the sum.
    """

    def __init__(self, inputs: int, planes: int, stride: int = 1, *, rectify: bool = True) -> None:
        super().__init__()
        self.conv1 = conv3x3(inputs, planes, stride)
        self.bn1 = nn.BatchNorm2d(planes)
        self.conv2 = conv3x3(planes, planes)
        self.bn2 = nn.BatchNorm2d(planes)
        self.downsample = shortcut(inputs, planes, stride)
        self.rectify = rectify

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, planes, H / stride, W / stride)."""
        hidden = functional.relu(self.bn1(self.conv1(features)), inplace=True)
        total = self.bn2(self.conv2(hidden)) + (features if self.downsample is None else self.downsample(features))
        return functional.relu(total, inplace=True) if self.rectify else total


class Bottleneck(nn.Module):
    """Bottleneck residual block: 1x1, 3x3 and 1x1 convolutions with a shortcut. The output has twice the planes;
    no ReLU follows the sum.

    Args:
        inputs: number of input channels.
        planes: number of channels of the 3x3 convolution.
        stride: stride of the 3x3 convolution.
    """

    EXPANSION = 2

    def __init__(self, inputs: int, planes: int, stride: int = 1) -> None:
        super().__init__()
        outputs = planes * self.EXPANSION
        self.conv1 = conv1x1(inputs, planes)
        self.bn1 = nn.BatchNorm2d(planes)
        self.conv2 = conv3x3(planes, planes, stride)
        self.bn2 = nn.BatchNorm2d(planes)
        self.conv3 = conv1x1(planes, outputs)
        self.bn3 = nn.BatchNorm2d(outputs)
        self.downsample = shortcut(inputs, outputs, stride)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, 2 planes, H / stride, W / stride)."""
        hidden = functional.relu(self.bn1(self.conv1(features)), inplace=True)
        hidden = functional.relu(self.bn2(self.conv2(hidden)), inplace=True)
        total: Tensor = self.bn3(self.conv3(hidden)) + (
            features if self.downsample is None else self.downsample(features)
        )
        return total


def shortcut(inputs: int, outputs: int, stride: int) -> nn.Sequential | None:
    """Makes the projection of a residual block: a 1x1 convolution that gives the block's input the shape of its
    output.

    Args:
        inputs, outputs: numbers of channels of the block's input and output.
        stride: stride of the block.

    Returns:
        Convolution and batch normalisation; None if the shapes are equal already.
    """
    if stride == 1 and inputs == outputs:
        return None
    return nn.Sequential(conv1x1(inputs, outputs, stride), nn.BatchNorm2d(outputs))


def stage(inputs: int, planes: int, stride: int = 1) -> nn.Sequential:
    """A stage of the network: two basic blocks; no ReLU follows the second one.

    Args:
        inputs: number of input channels.
        planes: number of channels of the blocks.
        stride: stride of the first block.
    """
    return nn.Sequential(BasicBlock(inputs, planes, stride), BasicBlock(planes, planes, rectify=False))


def pre_activated(convolution: nn.Conv2d, *pooling: nn.Module) -> nn.Sequential:
    """Makes a sequence of layers: pooling (if any), batch normalisation, ReLU, convolution.

    Args:
        convolution: the last layer.
        *pooling: the first layers.
    """
    norm = nn.BatchNorm2d(convolution.in_channels)
    return nn.Sequential(*pooling, norm, nn.ReLU(inplace=True), convolution)


class Dappm(nn.Module):
    """Deep aggregation pyramid pooling module: five pooling scales; the features of each scale are refined with
    the result of the next finer scale.

    Args:
        inputs: number of input channels.
        branch: number of channels of each scale.
        outputs: number of output channels.
    """

    def __init__(self, inputs: int, branch: int, outputs: int) -> None:
        super().__init__()
        self.scale0 = pre_activated(conv1x1(inputs, branch))
        self.scale1 = pre_activated(conv1x1(inputs, branch), nn.AvgPool2d(5, 2, 2))
        self.scale2 = pre_activated(conv1x1(inputs, branch), nn.AvgPool2d(9, 4, 4))
        self.scale3 = pre_activated(conv1x1(inputs, branch), nn.AvgPool2d(17, 8, 8))
        self.scale4 = pre_activated(conv1x1(inputs, branch), nn.AdaptiveAvgPool2d(1))
        self.process1 = pre_activated(conv3x3(branch, branch))
        self.process2 = pre_activated(conv3x3(branch, branch))
        self.process3 = pre_activated(conv3x3(branch, branch))
        self.process4 = pre_activated(conv3x3(branch, branch))
        self.compression = pre_activated(conv1x1(branch * 5, outputs))
        self.shortcut = pre_activated(conv1x1(inputs, outputs))

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, outputs, H, W) features."""
        scales = [self.scale0(features)]
        for pool, process in (
            (self.scale1, self.process1),
            (self.scale2, self.process2),
            (self.scale3, self.process3),
            (self.scale4, self.process4),
        ):
            scales.append(process(upsample(pool(features), features) + scales[-1]))
        joined: Tensor = self.compression(torch.cat(scales, dim=1)) + self.shortcut(features)
        return joined


class Head(nn.Module):
    """Output head: two convolutions that compute the output channels.

    Args:
        inputs: number of input channels.
        planes: number of channels between the convolutions.
        channels: number of output channels.
    """

    def __init__(self, inputs: int, planes: int, channels: int) -> None:
        super().__init__()
        self.bn1 = nn.BatchNorm2d(inputs)
        self.conv1 = conv3x3(inputs, planes)
        self.bn2 = nn.BatchNorm2d(planes)
        self.conv2 = nn.Conv2d(planes, channels, 1)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, channels, H, W) output maps."""
        hidden = self.conv1(functional.relu(self.bn1(features), inplace=True))
        maps: Tensor = self.conv2(functional.relu(self.bn2(hidden), inplace=True))
        return maps
