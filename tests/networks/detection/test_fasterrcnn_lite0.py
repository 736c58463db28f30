"""Faster R-CNN on EfficientNet-Lite0: its maps and anchors, its detections, and that training lowers its losses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from gear.networks.detection.fasterrcnn_lite0 import MAPS, PROPOSALS
from gear.networks.detection.options import ReferenceDetectorOptions
from gear.networks.network import as_batch
from gear.plugins.models.fasterrcnn_lite0_fpn import build
from tests.networks.detector_samples import street_samples

WIDTH_PX, HEIGHT_PX = 160, 96


@pytest.fixture(scope="module")
def network() -> Any:
    return build(ReferenceDetectorOptions(weights="none", device="cpu", input_scale=1.0))


def pictures() -> Any:
    return as_batch([sample.images for sample in street_samples(WIDTH_PX, HEIGHT_PX)], ["left"])


def test_there_is_an_objectness_for_each_anchor_of_all_maps(network: Any) -> None:
    with torch.no_grad():
        outputs = network.run_for_losses(pictures())
        seen = network(pictures())
    sides = [tuple(outputs[name].shape[2:]) for name in MAPS]
    assert sides == [(12, 20), (6, 10), (3, 5), (2, 3), (1, 2)]
    assert outputs["objectness"].shape[1] == 9 * sum(height * width for height, width in sides)
    assert outputs["anchors"].shape[1] == outputs["objectness"].shape[1]
    assert seen["proposals_px"].shape[1:] == (PROPOSALS, 4) and seen["class_logits"].shape[1:] == (PROPOSALS, 12)


def test_a_sure_proposal_is_a_detection_of_its_category(network: Any) -> None:
    """Class 0 is the background, so the class number of a category is one above its place in the list."""
    with torch.no_grad():
        outputs = dict(network(pictures()))
    logits = torch.full_like(outputs["class_logits"], -12.0)
    logits[..., 0] = 12.0
    logits[1, 3] = torch.tensor([0.0 if index == 3 else -12.0 for index in range(12)])
    box = torch.tensor([20.0, 30.0, 60.0, 50.0])
    outputs["proposals_px"][1, 3] = box
    changed = outputs | {"class_logits": logits, "box_regression": torch.zeros_like(outputs["box_regression"])}
    none, (one,) = network.predictions(changed, (HEIGHT_PX, WIDTH_PX))
    assert none == () and one.category_id == network.categories[3] == 3
    assert one.box_px == pytest.approx(box.tolist(), abs=1e-3) and one.score > 0.99


@pytest.mark.slow
def test_training_learns() -> None:
    """Eight steps on two pictures reduce the sum of the four losses."""
    model: Any = build(ReferenceDetectorOptions(weights="none", device="cpu", input_scale=1.0))
    samples = street_samples(WIDTH_PX, HEIGHT_PX)
    batch = pictures()
    optimiser = torch.optim.AdamW(model.parameters(), lr=1e-3)
    with torch.no_grad():
        first = {name: float(value) for name, value in model(batch, samples).items()}
    model.train()
    for _ in range(8):
        loss = sum(model(batch, samples).values())
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), 10.0)
        optimiser.step()
    assert set(first) == {"loss_classifier", "loss_box_reg", "loss_objectness", "loss_rpn_box_reg"}
    assert np.isfinite(loss.item()) and loss.item() < 0.8 * sum(first.values())
