"""gear's fast depth network: the graph of DDRNet-23-slim with one output channel, the logarithm of depth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from torch import Tensor, nn

from gear.networks.depth.losses import log_l1, root_mean_square, silog
from gear.networks.depth.network import DEPTH, DepthNetwork, resized
from gear.networks.depth.options import DepthOptions
from gear.networks.network import Normalise
from gear.networks.segmentation.ddrnet import DDRNet23Slim

MIDDLE_M = 10.0
"""Depth for a network output of 0, in metres. It is a typical depth in streets, near which training starts."""

RANGE_M = (0.05, 1000.0)
"""Range to which predicted depths are clamped, in metres, so that all numbers are finite."""

LAST_STD = 0.05

RMS_UNIT_M = 20.0
"""A root mean square error of this many metres counts as much in the loss as a logarithmic error of 1."""


def ddrnet_depth_graph() -> DDRNet23Slim:
    """DDRNet-23-slim with one output channel and random weights.

    The last layer has small weights, so that predictions are near 10 m at the start of training.
    """
    graph = DDRNet23Slim(1, auxiliary=False)
    nn.init.normal_(graph.final_layer.conv2.weight, std=LAST_STD)
    return graph


class DdrnetDepth(DepthNetwork):
    """gear's fast depth network: depth = 10 m * exp(channel). The channel is interpolated before the exponential."""

    multiple_px: ClassVar[int] = 8
    graph: DDRNet23Slim

    def __init__(self, graph: DDRNet23Slim, options: DepthOptions, *, input_scale: float = 1.0) -> None:
        super().__init__(graph, options, input_scale=input_scale)
        self._normalise = Normalise().to(self.device).eval()

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """`depth_m` (B, h, w) in metres at the size of the input."""
        height, width = (int(side) for side in picture.shape[2:])
        (channel,) = self.graph(self._normalise(picture))
        least, most = (math.log(limit_m / MIDDLE_M) for limit_m in RANGE_M)
        return {DEPTH: MIDDLE_M * resized(channel.float(), height, width)[:, 0].clamp(least, most).exp()}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Three losses: scale-invariant error, mean relative error, and root mean square error in units of
        `RMS_UNIT_M`.

        The scale-invariant error is dominated by outliers; the mean relative error is robust to them.
        """
        cap_m = self.options.max_depth_m
        return {
            "silog": silog(outputs[DEPTH], depth_m, cap_m=cap_m),
            "log_l1": log_l1(outputs[DEPTH], depth_m, cap_m=cap_m),
            "rms": root_mean_square(outputs[DEPTH], depth_m, cap_m=cap_m) / RMS_UNIT_M,
        }

    def taps(self) -> Mapping[str, nn.Module]:
        """The feature maps of the graph, with the names of `gear.networks.segmentation.ddrnet`."""
        return self.graph.taps()
