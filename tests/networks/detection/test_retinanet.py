"""RetinaNet as a gear network."""

from __future__ import annotations

from typing import Any

import pytest
import torch

from gear.networks import torchvision_import
from gear.networks.detection.retinanet import RetinaNetDetector
from gear.plugins.build import find
from gear.plugins.models.retinanet_r18_fpn import build_r18
from gear.values.rng import derive_rng


@pytest.fixture(scope="module")
def network() -> Any:
    if not torchvision_import.prepare():
        pytest.skip("torchvision is not installed")
    config: Any = find("model", "retinanet_r18_fpn").spec.config
    return build_r18(config(weights="none", device="cpu", input_scale=1.0))


def test_outputs_have_one_row_for_each_anchor(network: Any) -> None:
    assert isinstance(network, RetinaNetDetector)
    rng = derive_rng(0, "pictures")
    picture = torch.from_numpy(rng.random((2, 3, 64, 96), dtype="float32"))
    with torch.no_grad():
        outputs = network.run({"left": picture})
    anchors = outputs["anchors_px"]
    assert anchors.shape[0] == 2
    assert anchors.shape[2] == 4
    assert outputs["cls_logits"].shape[:2] == outputs["bbox_regression"].shape[:2] == anchors.shape[:2]
    assert sum(network._counts((64, 96))) == anchors.shape[1]
    width = anchors[0, :, 2] - anchors[0, :, 0]
    assert (width > 0).all()


def test_detections_are_sorted_by_score(network: Any) -> None:
    with torch.no_grad():
        views = {"left": torch.rand(1, 3, 64, 96, generator=torch.Generator().manual_seed(1))}
        (found,) = network.predictions(network.run_for_predictions(views), (64, 96))
    scores = [one.score for one in found]
    assert scores == sorted(scores, reverse=True)
