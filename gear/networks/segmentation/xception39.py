"""Xception39, BiSeNet's context path (Yu et al., arXiv 1808.00897), with the parameter names of the published
weights.
"""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn import functional

STEM_PLANES = 8
STAGES = ((16, 4), (32, 8), (64, 4))
"""Number of planes and number of blocks of the stages at 1/8, 1/16 and 1/32 of the picture's sides."""

EXPANSION = 4


class ConvBnRelu(nn.Module):
    """A convolution without bias, followed by optional batch normalisation and optional ReLU.

    Args:
        inputs, outputs: numbers of channels.
        kernel: side of the kernel, odd; the padding is half of it.
        stride: stride in both directions.
        norm: whether batch normalisation follows.
        rectify: whether ReLU follows.
    """

    def __init__(
        self, inputs: int, outputs: int, kernel: int, stride: int = 1, *, norm: bool = True, rectify: bool = True
    ) -> None:
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, padding=kernel // 2, bias=False)
        self.bn = nn.BatchNorm2d(outputs, eps=1e-5) if norm else None
        self.rectify = rectify

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, outputs, H / stride, W / stride)."""
        hidden: Tensor = self.conv(features)
        if self.bn is not None:
            hidden = self.bn(hidden)
        return functional.relu(hidden, inplace=True) if self.rectify else hidden


class Separable(nn.Module):
    """A separable convolution: a depth-wise 3x3 convolution, then a 1x1 convolution with batch normalisation.

    Args:
        inputs, outputs: numbers of channels.
        stride: stride of the 3x3 convolution.
        rectify: whether ReLU follows.
    """

    def __init__(self, inputs: int, outputs: int, stride: int = 1, *, rectify: bool = True) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, inputs, 3, stride, padding=1, groups=inputs, bias=False)
        self.point_wise_cbr = ConvBnRelu(inputs, outputs, 1, rectify=rectify)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, outputs, H / stride, W / stride)."""
        mixed: Tensor = self.point_wise_cbr(self.conv1(features))
        return mixed


class Block(nn.Module):
    """Residual block of Xception39: three separable convolutions with a shortcut; ReLU follows the sum.

    Args:
        inputs: number of input channels.
        planes: number of channels inside the block; the output has four times as many.
        stride: stride of the block; above 1 the shortcut has a convolution of its own.
    """

    def __init__(self, inputs: int, planes: int, stride: int) -> None:
        super().__init__()
        outputs = planes * EXPANSION
        self.proj = Separable(inputs, outputs, stride, rectify=False) if stride > 1 else None
        self.residual_branch = nn.Sequential(
            Separable(inputs, planes, stride), Separable(planes, planes), Separable(planes, outputs, rectify=False)
        )

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, 4 planes, H / stride, W / stride)."""
        short = features if self.proj is None else self.proj(features)
        return functional.relu(short + self.residual_branch(features), inplace=True)


class Xception39(nn.Module):
    """The context path of BiSeNet: a stem and three stages."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1 = ConvBnRelu(3, STEM_PLANES, 3, 2)
        self.maxpool = nn.MaxPool2d(3, 2, padding=1)
        (one, few), (two, many), (three, last) = STAGES
        self.layer1 = _stage(STEM_PLANES, one, few)
        self.layer2 = _stage(one * EXPANSION, two, many)
        self.layer3 = _stage(two * EXPANSION, three, last)

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Computes three feature maps of pictures: 64 channels at 1/8 of the sides, 128 at 1/16, 256 at 1/32.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        eighth = self.layer1(self.maxpool(self.conv1(pictures)))
        sixteenth = self.layer2(eighth)
        return eighth, sixteenth, self.layer3(sixteenth)


def _stage(inputs: int, planes: int, blocks: int) -> nn.Sequential:
    rest = (Block(planes * EXPANSION, planes, 1) for _ in range(blocks - 1))
    return nn.Sequential(Block(inputs, planes, 2), *rest)
