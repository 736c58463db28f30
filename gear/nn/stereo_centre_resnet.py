"""The network of centres on a ResNet-18 of its own: see `gear.nn.stereo_centre`."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.nn.stereo_centre import CentreGraph, StereoCentreShape, conv, conv_relu


class Block(nn.Module):
    """ResNet's basic block; its shortcut averages before it projects (ResNet-D, He et al., CVPR 2019)."""

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
        """(B, C, H, W) to (B, C', H / stride, W / stride)."""
        inner = functional.relu(self.bn1(self.conv1(features)))
        return functional.relu(self.bn2(self.conv2(inner)) + self.skip(features))


def _stage(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(Block(inputs, outputs, 2), Block(outputs, outputs, 1))


class StereoCentre(CentreGraph):
    """The first layers and one stage of the ResNet see both pictures, the other stages the left one and the volume."""

    def __init__(self, shape: StereoCentreShape) -> None:
        width = shape.width
        stages = [width * factor for factor in (2, 4, 6, 8)]
        super().__init__(shape, (width, *stages), pyramid=3 * width)
        self.stem = nn.Sequential(conv_relu(3, width, 3, 2), conv_relu(width, width, 3))
        self.layer1 = _stage(width, stages[0])
        self.fuse = conv_relu(stages[0] + 2 * width, stages[0], 1)
        self.layer2 = _stage(stages[0], stages[1])
        self.layer3 = _stage(stages[1], stages[2])
        self.layer4 = _stage(stages[2], stages[3])

    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """The stem's and the first stage's."""
        fine = self.stem(pictures)
        return fine, self.layer1(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """What goes into the second stage, and what the others give."""
        maps = [self.fuse(torch.cat([coarse, volume], dim=1))]
        for layer in (self.layer2, self.layer3, self.layer4):
            maps.append(layer(maps[-1]))
        return maps
