"""The centre-based stereo network on EfficientNet-Lite0, which can start from ImageNet weights.

Both pictures pass the layers at 1/2 and 1/4 of their size; the left picture's map at 1/4 passes the others. The volume
is added to that map by a layer with small initial weights, so that the trunk first receives inputs like those it was
trained on. See `gear.networks.stereo.centre`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from torch import Tensor, nn

from gear.networks.efficientnet_lite0 import CHANNELS, LEVELS, OnLite0, features_of_lite0
from gear.networks.stereo.centre import CentreGraph, StereoCentreShape

FUSE_STD = 0.01
"""Initial standard deviation of the fusing layer's weights, so that it adds under a hundredth of the trunk's own map.
"""


class StereoCentreLite0(CentreGraph, OnLite0):
    """The graph. Key names of the trunk are those of timm."""

    corrects_surface = True

    trunk: nn.Module
    fuse: nn.Module

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__(shape, CHANNELS, pyramid=2 * shape.width)

    def shared_layers(self) -> Mapping[str, nn.Module]:
        """`trunk`, complete: timm's layers lie in one module."""
        return {"trunk": features_of_lite0(range(len(LEVELS)))}

    def left_layers(self) -> Mapping[str, nn.Module]:
        """`fuse`, the layer that adds the volume."""
        fuse = nn.Conv2d(2 * self.shape.width, CHANNELS[1], 1, bias=False)
        nn.init.normal_(fuse.weight, std=FUSE_STD)
        return {"fuse": fuse}

    def lite0(self) -> nn.Module:
        """The trunk, an EfficientNet-Lite0."""
        return self.trunk

    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Feature maps of the first two stages."""
        trunk = self.trunk
        fine = trunk.get_submodule("blocks.0")(trunk.get_submodule("bn1")(trunk.get_submodule("conv_stem")(pictures)))
        return fine, trunk.get_submodule("blocks.1")(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """Input of the third stage, and the last map of each level."""
        maps = [coarse + self.fuse(volume)]
        for level in LEVELS[2:]:
            features = maps[-1]
            for stage in level:
                features = self.trunk.get_submodule(f"blocks.{stage}")(features)
            maps.append(features)
        return maps
