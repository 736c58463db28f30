"""gear's own fast depth network: DDRNet-23-slim with one output channel; depth is 10 m * exp(channel)."""

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
"""Depth in metres that corresponds to a network output of 0. It is a typical depth in streets, so training starts
near it.
"""

RANGE_M = (0.05, 1000.0)
"""Smallest and largest predicted depth in metres; predictions are clamped to this range, so all losses and metrics
are finite.
"""

LAST_STD = 0.05

RMS_UNIT_M = 20.0
"""Unit of the root mean square loss, in metres: an error of this size weighs as much as a logarithmic error of 1."""


def ddrnet_depth_graph() -> DDRNet23Slim:
    """Builds DDRNet-23-slim with one output channel and random weights.

    The last layer has small weights, so predictions are near 10 m at the start of training.
    """
    graph = DDRNet23Slim(1, auxiliary=False)
    nn.init.normal_(graph.final_layer.conv2.weight, std=LAST_STD)
    return graph


class DdrnetDepth(DepthNetwork):
    """gear's own fast depth network: depth = 10 m * exp(output channel). The channel is interpolated before the
    exponential.

    Args:
        graph: the torch module, from `ddrnet_depth_graph`.
        options: options that the user gave.
        input_scale: default factor by which pictures are resized, used if the options state none.
    """

    multiple_px: ClassVar[int] = 8
    graph: DDRNet23Slim

    def __init__(self, graph: DDRNet23Slim, options: DepthOptions, *, input_scale: float = 1.0) -> None:
        super().__init__(graph, options, input_scale=input_scale)
        self._normalise = Normalise().to(self.device).eval()

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """Returns the output `depth_m`: (B, h, w) depth in metres at the size of the input picture, within
        `RANGE_M`.

        Args:
            picture: (B, 3, h, w) in 0..1; h and w are multiples of 8.
        """
        height, width = (int(side) for side in picture.shape[2:])
        (channel,) = self.graph(self._normalise(picture))
        least, most = (math.log(limit_m / MIDDLE_M) for limit_m in RANGE_M)
        return {DEPTH: MIDDLE_M * resized(channel.float(), height, width)[:, 0].clamp(least, most).exp()}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Returns three losses: `silog`, the scale-invariant error; `log_l1`, the mean relative error; and `rms`,
        the root mean square error in units of 20 m (`RMS_UNIT_M`).

        The scale-invariant error is dominated by outliers; the mean relative error is robust to them.

        Args:
            outputs: result of `run` by name; the depth is (B, H, W) in metres.
            depth_m: (B, H, W) true depth in metres; NaN where unknown.
        """
        max_depth_m = self.options.max_depth_m
        return {
            "silog": silog(outputs[DEPTH], depth_m, max_depth_m=max_depth_m),
            "log_l1": log_l1(outputs[DEPTH], depth_m, max_depth_m=max_depth_m),
            "rms": root_mean_square(outputs[DEPTH], depth_m, max_depth_m=max_depth_m) / RMS_UNIT_M,
        }

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: `rb1` (1/4 of the sides), `rb2` and `rbb1` (1/8), `rbb2`
        (1/64), as in `gear.networks.segmentation.ddrnet`.
        """
        return self.graph.taps()
