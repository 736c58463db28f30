"""The centre-based stereo network (`gear.networks.stereo.centre`) with EfficientNet-Lite0 as trunk, initialised
with ImageNet weights.

Both pictures pass the trunk's layers at 1/2 and 1/4 of their sides; the left picture's map at 1/4 passes the later
layers. A layer with small initial weights adds the correlation volume to that map. At first the later layers therefore
receive inputs like those on which they were trained.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from torch import Tensor, nn

from gear.networks.efficientnet_lite0 import CHANNELS, LEVELS, OnLite0, features_of_lite0
from gear.networks.stereo.centre import CentreGraph, StereoCentreShape

FUSE_STD = 0.01
"""Initial standard deviation of the weights of the layer that adds the correlation volume; at first it adds less
than a hundredth of the trunk's own map.
"""


class StereoCentreLite0(CentreGraph, OnLite0):
    """The torch module of the centre-based stereo network with EfficientNet-Lite0 as trunk; parameters of the
    trunk have timm's names.

    Args:
        shape: size of the network.
    """

    corrects_surface = True

    trunk: nn.Module
    fuse: nn.Module

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__(shape, CHANNELS, pyramid=2 * shape.width)

    def shared_layers(self) -> Mapping[str, nn.Module]:
        """The layers that process both pictures: the whole trunk under the key `trunk`, because timm's
        EfficientNet-Lite0 is one module.
        """
        return {"trunk": features_of_lite0(range(len(LEVELS)))}

    def left_layers(self) -> Mapping[str, nn.Module]:
        """The layer that adds the correlation volume to the left features, under the key `fuse`."""
        fuse = nn.Conv2d(2 * self.shape.width, CHANNELS[1], 1, bias=False)
        nn.init.normal_(fuse.weight, std=FUSE_STD)
        return {"fuse": fuse}

    def lite0(self) -> nn.Module:
        """The trunk, an EfficientNet-Lite0 with the parameter names of timm."""
        return self.trunk

    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the feature maps of single pictures at the trunk's first two levels, at strides 2 and 4.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        trunk = self.trunk
        fine = trunk.get_submodule("blocks.0")(trunk.get_submodule("bn1")(trunk.get_submodule("conv_stem")(pictures)))
        return fine, trunk.get_submodule("blocks.1")(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """The left feature maps at strides 4, 8, 16 and 32: the input of the third stage, and the last map of each
        later level.

        Args:
            coarse: (B, C, H / 4, W / 4) left feature maps at stride 4.
            volume: (B, C, H / 4, W / 4) features of the correlation volume, at stride 4.
        """
        maps = [coarse + self.fuse(volume)]
        for level in LEVELS[2:]:
            features = maps[-1]
            for stage in level:
                features = self.trunk.get_submodule(f"blocks.{stage}")(features)
            maps.append(features)
        return maps
