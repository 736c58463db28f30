"""GLPDepth (Kim et al., arXiv 2201.07436): a mix transformer as encoder and a light decoder, from the package
transformers.

The network takes RGB in 0..1, without subtraction of a mean. Both sides of its input must be multiples of 32. Pictures
of other sizes are extended by reflection, at the top and evenly at the left and right, and the predicted depth is
cropped to the picture. Pictures are not resized, because that would change apparent sizes and therefore depths. Bottom
and middle of the picture stay where they are in the KITTI crops on which the published weights were trained.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import torch
from torch import Tensor, nn

from gear.networks.depth.losses import silog
from gear.networks.depth.network import DEPTH, DepthNetwork
from gear.networks.depth.options import HEADS, GlpnOptions
from gear.networks.depth.packages import need_transformers

MULTIPLE_PX = 32

LEAST_PX = MULTIPLE_PX // 2 + 1
"""Smallest side of a picture in pixels; smaller pictures cannot be extended by reflection."""


class Glpn(DepthNetwork):
    """GLPDepth as a gear network.

    Its graph is a `GLPNForDepthEstimation` of transformers, whose output is depth as a share (0..1) of the maximum
    depth. `DepthNetwork` documents the arguments.
    """

    options: GlpnOptions
    least_px: ClassVar[int] = LEAST_PX

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """Returns the output `depth_m`: (B, H, W) depth in metres at the picture's size.

        Args:
            picture: (B, 3, H, W) in 0..1; both sides are above 16 pixels.
        """
        height, width = (int(side) for side in picture.shape[2:])
        top, left = -height % MULTIPLE_PX, -width % MULTIPLE_PX // 2
        shares = self.graph(mirrored(picture, MULTIPLE_PX)).predicted_depth
        return {DEPTH: self.options.max_depth_m * shares[:, top : top + height, left : left + width].float()}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Returns `silog`, the scale-invariant logarithmic loss of the GLPDepth paper (equation 3).

        Args:
            outputs: result of `run` by name; the depth is (B, H, W) in metres.
            depth_m: (B, H, W) true depth in metres; NaN where unknown.
        """
        return {"silog": silog(outputs[DEPTH], depth_m, max_depth_m=self.options.max_depth_m)}

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: `stem` at 1/4 of the picture's sides, `trunk` at 1/32 and
        `decoder` at full size.
        """
        graph = self.graph
        return {
            "stem": graph.get_submodule("glpn.encoder.patch_embeddings.0.proj"),
            "trunk": graph.get_submodule("decoder.stages.0.convolution"),
            "decoder": graph.get_submodule("decoder.final_upsample"),
        }


def glpn_graph(options: GlpnOptions) -> nn.Module:
    """The GLPN of transformers with random initial weights.

    The encoder is initialised as in SegFormer (Xie et al., NeurIPS 2021), the decoder by torch's default for
    convolutions. transformers itself draws all weights with a standard deviation of 0.02. With that value the
    depth-wise convolutions, which have only nine inputs, would pass almost no signal.

    Args:
        options: sizes of the network.
    """
    need_transformers()
    from transformers import GLPNConfig, GLPNForDepthEstimation

    config = GLPNConfig(
        depths=list(options.blocks),
        hidden_sizes=list(options.widths),
        num_attention_heads=list(HEADS),
        decoder_hidden_size=options.decoder_width,
        max_depth=1,
    )
    graph = GLPNForDepthEstimation(config)
    graph.glpn.encoder.apply(_draw)
    for layer in (*graph.decoder.modules(), *graph.head.modules()):
        if isinstance(layer, nn.Conv2d):
            layer.reset_parameters()
    assert isinstance(graph, nn.Module)
    return graph


@torch.no_grad()
def _draw(layer: nn.Module) -> None:
    if isinstance(layer, nn.Conv2d):
        fan_out = math.prod(layer.kernel_size) * layer.out_channels // layer.groups
        layer.weight.normal_(0, math.sqrt(2 / fan_out))
    elif isinstance(layer, nn.Linear):
        nn.init.trunc_normal_(layer.weight, std=0.02)
    else:
        return
    if layer.bias is not None:
        layer.bias.zero_()


def mirrored(picture: Tensor, multiple_px: int) -> Tensor:
    """Returns pictures that are extended by reflection, at the top and evenly left and right, until their sides
    are multiples of a number.

    Args:
        picture: (B, C, H, W), any values.
        multiple_px: number of pixels of which the sides become multiples.
    """
    height, width = picture.shape[2:]
    top, across = -height % multiple_px, -width % multiple_px
    left, right = across // 2, across - across // 2
    rows = torch.cat([picture[:, :, 1 : top + 1].flip(2), picture], dim=2)
    return torch.cat([rows[..., 1 : left + 1].flip(3), rows, rows[..., width - 1 - right : width - 1].flip(3)], dim=3)
