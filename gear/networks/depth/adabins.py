"""AdaBins (monocular depth with adaptive bins) as a gear network.

The position encoding of AdaBins' transformer has room for at most 500 patches of 32 x 32 pixels. The transformer also
needs at least one token more than it has queries. A picture with more patches (2048 x 1024 has 2048) is reduced, a
picture with fewer patches is enlarged; the aspect ratio is kept. The predicted depth is resized back. KITTI's 1216 x
352 has 418 patches and is not resized.
"""

from __future__ import annotations

from collections.abc import Mapping

from torch import Tensor, nn
from torch.nn import functional

from gear.networks.depth.adabins_graph import BinsGraph, fitting
from gear.networks.depth.losses import adabins_silog, bins_chamfer
from gear.networks.depth.network import DEPTH, DepthNetwork, resized
from gear.networks.depth.options import BinsOptions
from gear.networks.network import Normalise

BINS = "bin_centres_m"
CHAMFER_WEIGHT = 0.1
"""Weight beta of the Chamfer loss on the bin centres (equation 6 of the AdaBins paper)."""


class AdaBins(DepthNetwork):
    """AdaBins (Bhat et al., CVPR 2021) as a gear network: monocular depth with bins that are chosen for each
    picture.

    Its outputs are `depth_m` (B, H, W) and `bin_centres_m` (B, bins); all in metres.

    Args:
        graph: the torch module.
        options: options that the user gave.
        input_scale: default factor by which pictures are resized, used if the options state none.
    """

    options: BinsOptions

    def __init__(self, graph: BinsGraph, options: BinsOptions, *, input_scale: float = 1.0) -> None:
        super().__init__(graph, options, input_scale=input_scale)
        self._normalise = Normalise().to(self.device).eval()

    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """Returns the outputs `depth_m` (B, H, W), at the size of the picture, and `bin_centres_m` (B, bins), the
        centres of the depth bins; all in metres.

        Args:
            picture: (B, 3, H, W) in 0..1. It is resized if its number of transformer tokens is out of the graph's
                range.
        """
        height, width = (int(side) for side in picture.shape[2:])
        seen = resized(picture, *fitting(height, width, min_patches=self.options.queries + 1))
        half_m, centres_m = self.graph(self._normalise(seen))
        depth_m = functional.interpolate(half_m, (height, width), mode="bilinear", align_corners=True)
        return {DEPTH: depth_m[:, 0], BINS: centres_m}

    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Returns the two losses of the AdaBins paper: `silog`, the scale-invariant error of the depth, and
        `bins`, the Chamfer distance between bin centres and true depths.

        Args:
            outputs: result of `run` by name; the depth is (B, H, W) in metres.
            depth_m: (B, H, W) true depth in metres; NaN where unknown.
        """
        max_depth_m = self.options.max_depth_m
        return {
            "silog": adabins_silog(outputs[DEPTH], depth_m, max_depth_m=max_depth_m),
            "bins": CHAMFER_WEIGHT * bins_chamfer(outputs[BINS], depth_m, max_depth_m=max_depth_m),
        }

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: `stem` at 1/2 of the picture's sides, `trunk` at 1/32 and
        `decoder` at 1/2.
        """
        return {
            "stem": self.graph.get_submodule("encoder.original_model.blocks.0"),
            "trunk": self.graph.get_submodule("encoder.original_model.conv_head"),
            "decoder": self.graph.get_submodule("decoder.conv3"),
        }
