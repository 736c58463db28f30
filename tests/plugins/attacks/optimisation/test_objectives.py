"""By what number patches are compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.plugins.attacks.optimisation.model_group import Group
from gear.plugins.attacks.optimisation.objectives import DepthObjective, LossObjective, SemsegObjective, counted
from gear.plugins.attacks.scene_specific import scene_specific
from gear.testing.attack_contract import AttackContract
from gear.testing.tiny_networks import TinyConfig, TinySegmenter

CLEAN_M = 10.0


class OnDepth(AttackContract):
    spec = scene_specific
    task = "depth"


class Off:
    """A depth network that is off by so many metres where there is a patch, which is any picture of ones."""

    def __init__(self, off_m: Tensor) -> None:
        self.off_m = off_m

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        picture = views["left"]
        is_patched = bool((picture == 1).all())
        return {"depth_m": torch.full_like(picture[:, 0], CLEAN_M) + self.off_m * is_patched}

    def predict(self, views: Any) -> Any:
        raise NotImplementedError

    def taps(self) -> Mapping[str, nn.Module]:
        return {}


def test_a_depth_network_that_is_more_wrong_is_more_harmed() -> None:
    sample = OnDepth().dataset()[0]
    height, width = sample.images["left"].shape[:2]

    def harm(off_m: Tensor) -> float:
        views = {"left": torch.ones(1, 3, height, width)}
        return float(sum(counted(DepthObjective(), Off(off_m), views, [sample], [0])))

    everywhere = torch.ones(1, height, width)
    one_pixel = torch.zeros(1, height, width)
    one_pixel[0, 0, 0] = 30.0
    assert harm(0.4 * everywhere) < harm(0.49 * everywhere) < harm(0.51 * everywhere) < harm(3.0 * everywhere)
    assert harm(one_pixel) < harm(0.4 * everywhere), "one pixel is not the whole picture"
    assert harm(3.0 * everywhere) == pytest.approx(2.5), "smooth L1 with a knee at 1 m"


class OnSemseg(AttackContract):
    spec = scene_specific


class Sure(Off):
    """A segmentation network that is as sure of the label as it is told, where there is a patch; quite sure else."""

    def __init__(self, margin: Tensor, label: int) -> None:
        super().__init__(margin)
        self.label = label

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        picture = views["left"]
        logits = picture.new_zeros(len(picture), 34, *picture.shape[2:])
        logits[:, 0] = 0.5  # of nothing that counts
        logits[:, self.label] = self.off_m if bool((picture == 1).all()) else 5.0
        return {"logits": logits}


@pytest.mark.parametrize("gamma", [1.0, 0.5, "dynamic"])
def test_what_is_wrong_by_the_patch_is_harmed_more_than_what_is_right_still(gamma: Any) -> None:
    """The paper looks at pixels that are still right, and there are none left for an attack that wins everywhere."""
    sample = OnSemseg().dataset()[0]
    height, width = sample.images["left"].shape[:2]
    label = int(np.bincount(sample.label_ids[sample.label_ids > 6]).argmax())

    def harm(margin: Tensor) -> float:
        views = {"left": torch.ones(1, 3, height, width)}
        return float(sum(counted(SemsegObjective(gamma=gamma), Sure(margin, label), views, [sample], [0])))

    everywhere = torch.ones(height, width)
    half = everywhere.clone()
    half[:, : width // 2] = -9.0
    harms = [harm(everywhere), harm(half), harm(-9.0 * everywhere)]
    assert 0 < harms[0] < harms[1] < harms[2]


def test_what_has_no_number_of_its_own_is_its_weighted_terms() -> None:
    dataset = OnSemseg().dataset()
    networks = {"one": TinySegmenter(TinyConfig()), "two": TinySegmenter(TinyConfig(seed=1))}
    views = {"left": torch.rand(2, 3, *dataset[0].images["left"].shape[:2])}
    objective = LossObjective(signs={"loss": -1.0})
    with torch.no_grad():
        wanted = [-float(network.forward(views, dataset)["loss"]) for network in networks.values()]
        assert [float(one) for one in counted(objective, Group(networks), views, dataset, [0, 1])] == wanted
