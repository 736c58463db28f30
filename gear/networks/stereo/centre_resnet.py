"""The centre-based stereo network (`gear.networks.stereo.centre`) with a ResNet-18 as trunk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.networks.stereo.centre import CentreGraph, StereoCentreShape, conv, conv_relu


class Block(nn.Module):
    """ResNet's basic block, whose shortcut averages features before the projection (ResNet-D, He et al., CVPR
    2019).

    Args:
        inputs, outputs: numbers of channels.
        stride: stride of the first convolution.
    """

    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(outputs)
        self.conv2 = nn.Conv2d(outputs, outputs, 3, 1, 1, bias=False)
        self.bn2 = nn.BatchNorm2d(outputs)
        self.skip: nn.Module = nn.Identity()
        if stride != 1 or inputs != outputs:
            self.skip = nn.Sequential(nn.AvgPool2d(stride), conv(inputs, outputs, 1))

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, outputs, H / stride, W / stride)."""
        inner = functional.relu(self.bn1(self.conv1(features)))
        return functional.relu(self.bn2(self.conv2(inner)) + self.skip(features))


def _stage(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(Block(inputs, outputs, 2), Block(outputs, outputs, 1))


def _channels(shape: StereoCentreShape) -> list[int]:
    return [shape.width * factor for factor in (2, 4, 6, 8)]


class StereoCentre(CentreGraph):
    """The torch module of the centre-based stereo network with a ResNet-18 as trunk. Left and right picture pass
    the stem and one stage of the ResNet; the left features and the correlation volume pass the later stages.

    Args:
        shape: size of the network.
    """

    stem: nn.Module
    layer1: nn.Module
    fuse: nn.Module
    layer2: nn.Module
    layer3: nn.Module
    layer4: nn.Module

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__(shape, (shape.width, *_channels(shape)), pyramid=3 * shape.width)

    def shared_layers(self) -> Mapping[str, nn.Module]:
        """The layers `stem` and `layer1`, which process both pictures, by key name."""
        width = self.shape.width
        return {
            "stem": nn.Sequential(conv_relu(3, width, 3, 2), conv_relu(width, width, 3)),
            "layer1": _stage(width, _channels(self.shape)[0]),
        }

    def left_layers(self) -> Mapping[str, nn.Module]:
        """The layers `fuse` and `layer2` to `layer4`, which process the left features and the correlation volume,
        by key name.
        """
        one, two, three, four = _channels(self.shape)
        return {
            "fuse": conv_relu(one + 2 * self.shape.width, one, 1),
            "layer2": _stage(one, two),
            "layer3": _stage(two, three),
            "layer4": _stage(three, four),
        }

    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the feature maps of single pictures after the stem and the first stage, at strides 2 and 4.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        fine = self.stem(pictures)
        return fine, self.layer1(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """The left feature maps at strides 4, 8, 16 and 32: the input of the second stage, and the outputs of the
        later stages.

        Args:
            coarse: (B, C, H / 4, W / 4) left feature maps at stride 4.
            volume: (B, C, H / 4, W / 4) features of the correlation volume, at stride 4.
        """
        maps = [self.fuse(torch.cat([coarse, volume], dim=1))]
        for layer in (self.layer2, self.layer3, self.layer4):
            maps.append(layer(maps[-1]))
        return maps
