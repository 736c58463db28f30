"""DDRNet-23-slim (Hong et al., arXiv 2101.06085), with the parameter names of its authors' published weights."""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn import functional

from gear.networks.segmentation.ddrnet_parts import Bottleneck, Dappm, Head, conv1x1, conv3x3, stage, upsample

PLANES = 32
BRANCH_PLANES = 128
HEAD_PLANES = 64


class DDRNet23Slim(nn.Module):
    """DDRNet-23-slim: two branches, one at 1/8 of the picture's sides and one down to 1/64, that exchange features
    twice.

    Attributes:
        align_corners: value of this option of torch's interpolation with which the maps must be resized to the picture.
    """

    align_corners = False

    def __init__(self, channels: int, *, auxiliary: bool = True) -> None:
        """Makes the network with random weights (He initialisation, fan-out).

        Args:
            channels: number of output channels: number of classes, or 1 for a depth map.
            auxiliary: whether the network has the auxiliary head, which only training uses.
        """
        super().__init__()
        high = PLANES * 2
        self.conv1 = nn.Sequential(
            conv3x3(3, PLANES, 2, bias=True), nn.BatchNorm2d(PLANES), nn.ReLU(inplace=True),
            conv3x3(PLANES, PLANES, 2, bias=True), nn.BatchNorm2d(PLANES), nn.ReLU(inplace=True),
        )  # fmt: skip
        self.layer1 = stage(PLANES, PLANES)
        self.layer2 = stage(PLANES, PLANES * 2, 2)
        self.layer3 = stage(PLANES * 2, PLANES * 4, 2)
        self.layer4 = stage(PLANES * 4, PLANES * 8, 2)
        self.compression3 = nn.Sequential(conv1x1(PLANES * 4, high), nn.BatchNorm2d(high))
        self.compression4 = nn.Sequential(conv1x1(PLANES * 8, high), nn.BatchNorm2d(high))
        self.down3 = nn.Sequential(conv3x3(high, PLANES * 4, 2), nn.BatchNorm2d(PLANES * 4))
        self.down4 = nn.Sequential(
            conv3x3(high, PLANES * 4, 2), nn.BatchNorm2d(PLANES * 4), nn.ReLU(inplace=True),
            conv3x3(PLANES * 4, PLANES * 8, 2), nn.BatchNorm2d(PLANES * 8),
        )  # fmt: skip
        self.layer3_ = stage(PLANES * 2, high)
        self.layer4_ = stage(high, high)
        self.layer5_ = nn.Sequential(Bottleneck(high, high))
        self.layer5 = nn.Sequential(Bottleneck(PLANES * 8, PLANES * 8, 2))
        self.spp = Dappm(PLANES * 16, BRANCH_PLANES, PLANES * 4)
        self.seghead_extra = Head(high, HEAD_PLANES, channels) if auxiliary else None
        self.final_layer = Head(PLANES * 4, HEAD_PLANES, channels)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, mode="fan_out", nonlinearity="relu")

    def forward(self, pictures: Tensor, *, auxiliary: bool = False) -> list[Tensor]:
        """Computes the output maps at 1/8 of the picture's sides.

        Args:
            pictures: (B, 3, H, W), normalised. Both branches stay aligned if H and W are multiples of 8.
            auxiliary: whether the map of the auxiliary head is returned as well.

        Returns:
            Maps (B, channels, H / 8, W / 8): the map of the main head, then the map of the auxiliary head.
        """
        relu = functional.relu
        eighth = self.layer2(relu(self.layer1(self.conv1(pictures))))
        low = self.layer3(relu(eighth))
        high = self.layer3_(relu(eighth))
        low, high = low + self.down3(relu(high)), high + upsample(self.compression3(relu(low)), high)
        extra = high
        low = self.layer4(relu(low))
        high = self.layer4_(relu(high))
        low, high = low + self.down4(relu(high)), high + upsample(self.compression4(relu(low)), high)
        high = self.layer5_(relu(high))
        context = self.spp(self.layer5(relu(low)))
        maps = [self.final_layer(upsample(context, high) + high)]
        if auxiliary and self.seghead_extra is not None:
            maps.append(self.seghead_extra(extra))
        return maps

    def taps(self) -> dict[str, nn.Module]:
        """The modules whose outputs are feature maps, with the names that the Z-Mask paper uses (Rossolini et al.,
        AAAI 2023).

        `rb1` at 1/4 and `rb2` at 1/8 of the picture's sides lie before the branches separate; `rbb1` at 1/8 and `rbb2`
        at 1/64 lie at the ends of the branches. All are taken before the activation ReLU.
        """
        return {"rb1": self.layer1, "rb2": self.layer2, "rbb1": self.layer5_, "rbb2": self.layer5}
