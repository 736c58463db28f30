"""The centre-based stereo network (`gear.networks.stereo.centre`) on EfficientNet-Lite0, with ImageNet weights at the
start.

Both pictures pass the layers at 1/2 and 1/4 of their sides; the left picture's map at 1/4 passes the others. A layer
with small initial weights adds the correlation volume to that map, so that at first the trunk receives inputs like
those on which it was trained.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from torch import Tensor, nn

from gear.networks.efficientnet_lite0 import CHANNELS, LEVELS, OnLite0, features_of_lite0
from gear.networks.stereo.centre import CentreGraph, StereoCentreShape

FUSE_STD = 0.01
"""Initial standard deviation of the weights of the layer that adds the volume; it adds less than a hundredth of
the trunk's own map.
"""


class StereoCentreLite0(CentreGraph, OnLite0):
    """The graph; parameters of the trunk have timm's names."""

    corrects_surface = True

    trunk: nn.Module
    fuse: nn.Module

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__(shape, CHANNELS, pyramid=2 * shape.width)

    def shared_layers(self) -> Mapping[str, nn.Module]:
        """`trunk`, the whole trunk, since timm's layers lie in one module."""
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
        """Feature maps of the first two levels, at strides 2 and 4."""
        trunk = self.trunk
        fine = trunk.get_submodule("blocks.0")(trunk.get_submodule("bn1")(trunk.get_submodule("conv_stem")(pictures)))
        return fine, trunk.get_submodule("blocks.1")(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """Feature maps at strides 4, 8, 16 and 32: the input of the third stage, and the last map of each later
        level.
        """
        maps = [coarse + self.fuse(volume)]
        for level in LEVELS[2:]:
            features = maps[-1]
            for stage in level:
                features = self.trunk.get_submodule(f"blocks.{stage}")(features)
            maps.append(features)
        return maps
