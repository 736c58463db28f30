"""BiSeNet with Xception39 (Yu et al., arXiv 1808.00897), with the parameter names of TorchSeg's published weights."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.networks.segmentation.xception39 import ConvBnRelu, Xception39

PLANES = 128


def upsample(features: Tensor, size: torch.Size) -> Tensor:
    """Resizes features bilinearly, with aligned corners as everywhere in this network.

    Args:
        features: (B, C, h, w).
        size: height and width of the result.
    """
    return functional.interpolate(features, size=size, mode="bilinear", align_corners=True)


class SpatialPath(nn.Module):
    """The spatial path of BiSeNet: four convolutions that compute 128 channels at 1/8 of the picture's sides."""

    def __init__(self) -> None:
        super().__init__()
        self.conv_7x7 = ConvBnRelu(3, 64, 7, 2)
        self.conv_3x3_1 = ConvBnRelu(64, 64, 3, 2)
        self.conv_3x3_2 = ConvBnRelu(64, 64, 3, 2)
        self.conv_1x1 = ConvBnRelu(64, PLANES, 1)

    def forward(self, pictures: Tensor) -> Tensor:
        """Converts `pictures` (B, 3, H, W), normalised, to (B, 128, H / 8, W / 8) features."""
        features: Tensor = self.conv_1x1(self.conv_3x3_2(self.conv_3x3_1(self.conv_7x7(pictures))))
        return features


class AttentionRefinement(nn.Module):
    """Attention refinement module of BiSeNet: a 3x3 convolution whose output channels are scaled by factors
    computed from their global averages.

    Args:
        inputs: number of channels of the input.
    """

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.conv_3x3 = ConvBnRelu(inputs, PLANES, 3)
        self.channel_attention = nn.Sequential(
            nn.AdaptiveAvgPool2d(1), ConvBnRelu(PLANES, PLANES, 1, rectify=False), nn.Sigmoid()
        )

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, 128, H, W)."""
        mixed: Tensor = self.conv_3x3(features)
        weights: Tensor = self.channel_attention(mixed)
        return mixed * weights


class FeatureFusion(nn.Module):
    """Feature fusion module of BiSeNet: joins the spatial and the context path and scales each channel by channel
    attention.
    """

    def __init__(self) -> None:
        super().__init__()
        planes = PLANES * 2
        self.conv_1x1 = ConvBnRelu(planes, planes, 1)
        self.channel_attention = nn.Sequential(
            nn.AdaptiveAvgPool2d(1),
            ConvBnRelu(planes, planes, 1, norm=False),
            ConvBnRelu(planes, planes, 1, norm=False, rectify=False),
            nn.Sigmoid(),
        )

    def forward(self, spatial: Tensor, context: Tensor) -> Tensor:
        """Joins two feature maps (B, 128, H, W) to one (B, 256, H, W).

        Args:
            spatial: features of the spatial path.
            context: features of the context path.
        """
        fused: Tensor = self.conv_1x1(torch.cat([spatial, context], dim=1))
        weights: Tensor = self.channel_attention(fused)
        return fused + fused * weights


class Head(nn.Module):
    """Output head: convolutions that compute one logit map for each class.

    Args:
        inputs: number of channels of the input.
        planes: number of channels between the two convolutions.
        classes: number of classes.
    """

    def __init__(self, inputs: int, planes: int, classes: int) -> None:
        super().__init__()
        self.conv_3x3 = ConvBnRelu(inputs, planes, 3)
        self.conv_1x1 = nn.Conv2d(planes, classes, 1)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, classes, H, W) logits."""
        maps: Tensor = self.conv_1x1(self.conv_3x3(features))
        return maps


class BiSeNetX39(nn.Module):
    """BiSeNet: a spatial path at 1/8 of the picture's sides and a context path down to 1/32, joined at 1/8.

    The authors' code interpolates to the picture's size and returns log-probabilities. This module returns the smaller
    logit maps; the caller interpolates the maps and may apply `log_softmax`.

    Attributes:
        align_corners: value of this option of torch's interpolation with which the maps must be resized to the picture.
    """

    align_corners = True

    def __init__(self, classes: int, *, auxiliary: bool = True) -> None:
        """Makes the network with random weights (He initialisation, fan-in).

        Args:
            classes: number of classes.
            auxiliary: whether the network has the two auxiliary heads, which only training uses.
        """
        super().__init__()
        self.context_path = Xception39()
        self.spatial_path = SpatialPath()
        self.global_context = nn.Sequential(nn.AdaptiveAvgPool2d(1), ConvBnRelu(256, PLANES, 1))
        self.arms = nn.ModuleList([AttentionRefinement(256), AttentionRefinement(128)])
        self.refines = nn.ModuleList([ConvBnRelu(PLANES, PLANES, 3), ConvBnRelu(PLANES, PLANES, 3)])
        self.ffm = FeatureFusion()
        heads: dict[str, nn.Module] = {"2": Head(PLANES * 2, 64, classes)}
        if auxiliary:
            heads = {"0": Head(PLANES, PLANES, classes), "1": Head(PLANES, PLANES, classes)} | heads
        self.heads = nn.ModuleDict(heads)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_in", nonlinearity="relu")

    def forward(self, pictures: Tensor, *, auxiliary: bool = False) -> list[Tensor]:
        """Computes logit maps that are smaller than the picture.

        Args:
            pictures: (B, 3, H, W), normalised.
            auxiliary: whether the maps of the auxiliary heads are returned as well.

        Returns:
            Maps (B, classes, h, w): the map of the main head at 1/8 of the picture's sides, then the maps of the
            auxiliary heads at 1/16 and 1/8.
        """
        spatial = self.spatial_path(pictures)
        eighth, sixteenth, thirty_second = self.context_path(pictures)
        context = upsample(self.global_context(thirty_second), thirty_second.shape[2:])
        refined = []
        for features, finer, arm, refine in zip(
            (thirty_second, sixteenth), (sixteenth, eighth), self.arms, self.refines, strict=True
        ):
            context = refine(upsample(arm(features) + context, finer.shape[2:]))
            refined.append(context)
        maps = [self.heads["2"](self.ffm(spatial, context))]
        if auxiliary and "0" in self.heads:
            maps += [self.heads[str(index)](features) for index, features in enumerate(refined)]
        return maps

    def taps(self) -> dict[str, nn.Module]:
        """The modules whose outputs are feature maps, with the names that the Z-Mask paper uses (Rossolini et al.,
        AAAI 2023).

        `spatial_7x7` at 1/2 and `spatial_1x1` at 1/8 of the picture's sides belong to the spatial path; `ct2`, `ct1`
        and `ct0` at 1/8, 1/16 and 1/32 to the context path.
        """
        return {
            "spatial_7x7": self.spatial_path.conv_7x7,
            "spatial_1x1": self.spatial_path.conv_1x1,
            "ct2": self.context_path.layer1,
            "ct1": self.context_path.layer2,
            "ct0": self.context_path.layer3,
        }
