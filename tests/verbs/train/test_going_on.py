"""What of a network is trained that does not begin with random weights."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from gear.contracts.specs import ModelSpec
from gear.networks.detection.options import ReferenceDetectorOptions
from gear.networks.weights import read, write
from gear.plugins.build import find
from gear.plugins.models.retinanet_r18_fpn import build_lite0
from gear.verbs.train.config import read_config
from gear.verbs.train.run import train
from gear.verbs.train.starting import build_network, load_initial_weights

BODY = "backbone.body."
STATISTICS = ("running_mean", "running_var")


@pytest.mark.parametrize(("init", "is_kept"), [("{}", True), ("trunk:{}", False), ("none", False)])
def test_a_trunk_with_whole_weights_keeps_its_statistics_and_first_layers(
    street: Callable[..., Path], tmp_path: Path, init: str, is_kept: bool
) -> None:
    """Like one that begins with ImageNet's: batches of detectors are too small to measure either anew.

    Of another network's weights only some may fit, and what stays random must be learnt.
    """
    network = build_lite0(ReferenceDetectorOptions(weights="none", seed=0))
    first = tmp_path / "first.safetensors"
    write(first, network.module().state_dict(), {"model": "retinanet_lite0_fpn", "task": "detect2d"}, halves=True)
    report = train(
        "detect2d", "retinanet_lite0_fpn", street("detect2d"), out=tmp_path / "out", epochs=1, batch=2, lr=0.01,
        init=init.format(first), settings=["crop_px=[32, 64]", "ema=0", "validation_samples=1"],
    )  # fmt: skip
    (before, _), (after, _) = read(first), read(report.weights)
    body = [key for key in before if key.startswith(BODY)]
    kept = [key for key in body if key.startswith(f"{BODY}conv_stem") or key.endswith(STATISTICS)]
    learnt = [key for key in body if key not in kept and key.endswith("conv_pw.weight") and ".blocks.4." in key]
    assert len(kept) > 90 and learnt
    assert {torch.equal(before[key], after[key]) for key in kept} == {is_kept}
    assert not any(torch.equal(before[key], after[key]) for key in learnt)


@pytest.mark.parametrize(("name", "is_told"), [("retinanet_r50_fpn", True), ("retinanet_r18_fpn", False)])
def test_a_part_that_would_keep_random_weights_is_reported(name: str, is_told: bool) -> None:
    found = find("model", name)
    assert isinstance(found.spec, ModelSpec)
    model = build_network(found, read_config(found.spec.recipe, {}, ()), precision="float32")
    told = load_initial_weights(found, model, "")
    assert told.startswith(f"{name} leaves a part as it begins, which is at random (0.2") == is_told
    assert told.endswith("begin with --init FILE") == is_told and bool(told) == is_told
