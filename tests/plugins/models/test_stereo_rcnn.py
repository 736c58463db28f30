from __future__ import annotations

from typing import ClassVar

from gear.contracts.models import Model
from gear.networks.stereo.options import StereoRcnnOptions
from gear.networks.stereo.rcnn_graph import StereoRcnnShape
from gear.networks.stereo.rcnn_network import StereoRcnnNetwork
from gear.plugins.models.stereo_rcnn import stereo_rcnn
from gear.testing.model_contract import ModelContract


class TestStereoRcnn(ModelContract):
    """The contract on a narrow network: the published one takes a minute a sample here."""

    spec = stereo_rcnn
    options: ClassVar[dict[str, object]] = {
        "weights": "none",
        "device": "cpu",
        "short_side_px": 64,
        "pre_nms_top_n": 200,
        "proposals": 12,
    }

    def make(self) -> Model:
        shape = StereoRcnnShape(blocks=(1, 1, 1, 1), width=8, pyramid=16, proposals=16, hidden=32)
        return StereoRcnnNetwork(StereoRcnnOptions(**self.options), shape)  # type: ignore[arg-type]
