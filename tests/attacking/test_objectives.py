"""By what number patches are compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest
import torch
from torch import Tensor, nn

from gear.attacking.group import Group
from gear.attacking.objectives import DepthObjective, SemsegObjective, counted
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


def test_what_has_no_number_of_its_own_is_its_weighted_terms() -> None:
    class OnSemseg(AttackContract):
        spec = scene_specific

    dataset = OnSemseg().dataset()
    networks = {"one": TinySegmenter(TinyConfig()), "two": TinySegmenter(TinyConfig(seed=1))}
    views = {"left": torch.rand(2, 3, *dataset[0].images["left"].shape[:2])}
    objective = SemsegObjective(gamma=0.3)
    with torch.no_grad():
        wanted = [
            float(term.weight * term.value)
            for network in networks.values()
            for term in objective.terms(network, views, dataset, [0, 1]).values()
        ]
        assert [float(one) for one in counted(objective, Group(networks), views, dataset, [0, 1])] == wanted
