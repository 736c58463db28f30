"""GLPDepth (Kim et al., arXiv 2201.07436): a mix transformer and a light decoder, in the graph of transformers.

Pictures go in as RGB in 0..1, without mean and deviation. The graph wants sides that are multiples of 32. Others are
mirrored outwards at the top and, evenly, at the sides, and the answer is cut back: no pixel is resampled, which would
make everything look nearer or farther than it is, and the picture stays aligned at the bottom and the middle, as the
KITTI crops are on which the published weights were trained.
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
"""Of a picture's sides: of fewer pixels there is not enough to mirror."""


class Glpn(DepthNetwork):
    """GLPDepth; `graph` is a `GLPNForDepthEstimation` whose answers are shares of the greatest depth."""

    options: GlpnOptions
    least_px: ClassVar[int] = LEAST_PX

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """`depth_m` at the picture's size; its sides must be above 16 pixels."""
        height, width = (int(side) for side in picture.shape[2:])
        top, left = -height % MULTIPLE_PX, -width % MULTIPLE_PX // 2
        shares = self.graph(mirrored(picture, MULTIPLE_PX)).predicted_depth
        return {DEPTH: self.options.max_depth_m * shares[:, top : top + height, left : left + width].float()}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """The paper's scale-invariant loss."""
        return {"silog": silog(outputs[DEPTH], depth_m, cap_m=self.options.max_depth_m)}

    def taps(self) -> Mapping[str, nn.Module]:
        """`stem` at a quarter of the picture's sides, `trunk` at a 32nd, `decoder` at full size."""
        graph = self.graph
        return {
            "stem": graph.get_submodule("glpn.encoder.patch_embeddings.0.proj"),
            "trunk": graph.get_submodule("decoder.stages.0.convolution"),
            "decoder": graph.get_submodule("decoder.final_upsample"),
        }


def glpn_graph(options: GlpnOptions) -> nn.Module:
    """transformers' graph with random weights.

    The encoder's are drawn as SegFormer's (Xie et al., NeurIPS 2021), the decoder's as torch draws convolutions.
    transformers' own deviation of 0.02 for everything leaves depth-wise convolutions, which have nine inputs, almost
    without signal.
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
    """Pads (B, C, H, W) to multiples by reflection, at the top and evenly left and right."""
    height, width = picture.shape[2:]
    top, across = -height % multiple_px, -width % multiple_px
    left, right = across // 2, across - across // 2
    rows = torch.cat([picture[:, :, 1 : top + 1].flip(2), picture], dim=2)
    return torch.cat([rows[..., 1 : left + 1].flip(3), rows, rows[..., width - 1 - right : width - 1].flip(3)], dim=3)
