"""The network of centres on EfficientNet-Lite0, which may begin with what ImageNet taught it.

Both pictures go through the layers at a half and a quarter of their size, the left one's map there through the others.
What the volume says is added to that map by a layer that begins small, so that the trunk at first sees little but what
it knows. See `gear.networks.stereo.centre`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from torch import Tensor, nn

from gear.networks.efficientnet_lite0 import CHANNELS, LEVELS, OnLite0, features_of_lite0
from gear.networks.stereo.centre import CentreGraph, StereoCentreShape

FUSE_STD = 0.01
"""What it adds is under a hundredth of a map that ImageNet taught the trunk to give."""


class StereoCentreLite0(CentreGraph, OnLite0):
    """Key names of the trunk are timm's."""

    corrects_surface = True

    trunk: nn.Module
    fuse: nn.Module

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__(shape, CHANNELS, pyramid=2 * shape.width)

    def shared_layers(self) -> Mapping[str, nn.Module]:
        """`trunk`, all of it: timm's layers lie in one module."""
        return {"trunk": features_of_lite0(range(len(LEVELS)))}

    def left_layers(self) -> Mapping[str, nn.Module]:
        """`fuse`."""
        fuse = nn.Conv2d(2 * self.shape.width, CHANNELS[1], 1, bias=False)
        nn.init.normal_(fuse.weight, std=FUSE_STD)
        return {"fuse": fuse}

    def lite0(self) -> nn.Module:
        """The trunk."""
        return self.trunk

    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """The first two stages'."""
        trunk = self.trunk
        fine = trunk.get_submodule("blocks.0")(trunk.get_submodule("bn1")(trunk.get_submodule("conv_stem")(pictures)))
        return fine, trunk.get_submodule("blocks.1")(fine)

    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """What goes into the third stage, and what each level ends with."""
        maps = [coarse + self.fuse(volume)]
        for level in LEVELS[2:]:
            features = maps[-1]
            for stage in level:
                features = self.trunk.get_submodule(f"blocks.{stage}")(features)
            maps.append(features)
        return maps
