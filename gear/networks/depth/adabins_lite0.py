"""The head of AdaBins (`gear.networks.depth.adabins_graph`) on EfficientNet-Lite0.

The encoder can be initialised with ImageNet weights.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor, nn

from gear.networks.depth.adabins import AdaBins
from gear.networks.depth.adabins_graph import BinsGraph
from gear.networks.depth.options import BinsOptions
from gear.networks.depth.packages import need_timm
from gear.networks.efficientnet_lite0 import CHANNELS, LEVELS, MEAN, STD, OnLite0, features_of_lite0
from gear.networks.network import Normalise


class LiteEncoder(OnLite0):
    """An encoder for `BinsGraph`: EfficientNet-Lite0 without its classifier and the convolution before it."""

    def __init__(self) -> None:
        need_timm()
        super().__init__()
        self.body = features_of_lite0(range(len(LEVELS)))

    def lite0(self) -> nn.Module:
        """The EfficientNet-Lite0, with the parameter names of timm."""
        return self.body

    def forward(self, pictures: Tensor) -> list[Tensor]:
        """Returns the feature maps of pictures at 1/2, 1/4, 1/8, 1/16 and 1/32 of their sides, in channels-last
        memory format, in which convolutions are faster on CPUs.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        maps: list[Tensor] = self.body(pictures.contiguous(memory_format=torch.channels_last))
        return maps


def adabins_lite0_graph(options: BinsOptions) -> BinsGraph:
    """Builds the head of AdaBins on EfficientNet-Lite0 with random weights.

    Args:
        options: sizes of the head, and the range of depths.
    """
    return BinsGraph(LiteEncoder(), CHANNELS, options)


class LiteAdaBins(AdaBins):
    """AdaBins with EfficientNet-Lite0 as encoder; `AdaBins` documents its arguments and outputs."""

    def __init__(self, graph: BinsGraph, options: BinsOptions, *, input_scale: float = 1.0) -> None:
        super().__init__(graph, options, input_scale=input_scale)
        self._normalise = Normalise(MEAN, STD).to(self.device).eval()

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: `stem` at 1/2 of the picture's sides, `trunk` at 1/32 and
        `decoder` at 1/2.
        """
        return {
            "stem": self.graph.get_submodule("encoder.body.blocks.0"),
            "trunk": self.graph.get_submodule("encoder.body.blocks.6"),
            "decoder": self.graph.get_submodule("decoder.conv3"),
        }
