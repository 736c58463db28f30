"""The terms of each task by hand: which pixels count, which way they are pushed, and how much."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from gear.formats import rle
from gear.formats.cityscapes import LABELS
from gear.plugins.attacks.optimisation.objectives import (
    DepthObjective,
    LossObjective,
    SemsegObjective,
    class_of,
    counted,
    default_objective,
    outside,
    train_labels,
)
from gear.values.errors import GearError

SHAPE = (2, 4)
ROAD, CAR, STATIC = 7, 26, 4
CPU = torch.device("cpu")


@dataclass(frozen=True)
class Surface:
    camera: str
    mask_rle: str
    visible_px: int


def surface(camera: str, *columns: int) -> Surface:
    mask = np.zeros(SHAPE, np.bool_)
    mask[:, list(columns)] = True
    return Surface(camera, rle.encode(mask), int(mask.sum()))


@dataclass(frozen=True)
class Pictures:
    surfaces: tuple[Surface, ...] = ()
    images: Mapping[str, Any] = field(
        default_factory=lambda: {name: np.zeros((*SHAPE, 3), np.uint8) for name in ("left", "right")}
    )


@dataclass(frozen=True)
class Labelled(Pictures):
    label_ids: Any = None


@dataclass(frozen=True)
class Deep(Pictures):
    depth_m: Any = None


@dataclass
class Says:
    """A network that says the same to every picture, and something else to the clean one, which is all black."""

    said: Mapping[str, Tensor]
    clean: Mapping[str, Tensor] | None = None

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        is_clean = self.clean is not None and not bool(views["left"].any())
        return self.clean if is_clean and self.clean is not None else self.said


VIEWS = {"left": torch.ones(1, 3, *SHAPE)}


def test_what_shows_a_patch_of_this_view_does_not_count() -> None:
    sample = Pictures((surface("left", 0), surface("right", 1), surface("left", 3), Surface("left", "", 0)))
    assert outside([sample, Pictures()], "left", CPU).tolist() == [[[False, True, True, False]] * 2, [[True] * 4] * 2]
    assert outside([sample], "right", CPU).tolist() == [[[True, False, True, True]] * 2]


def segmented() -> tuple[Labelled, Tensor]:
    """Roads and cars, one column of them on the patch and one static; sure of road on the left, of car on the right."""
    ids = np.array([[ROAD, ROAD, ROAD, STATIC], [ROAD, CAR, CAR, STATIC]], np.uint8)
    logits = torch.zeros(1, 19, *SHAPE)
    logits[0, 0, :, :2], logits[0, 13, :, 2:] = 2.0, 3.0
    return Labelled(surfaces=(surface("left", 0),), label_ids=ids), logits


def cost(margin: float, *, is_right: bool) -> float:
    """Cross-entropy of 19 classes, one of which leads by a margin."""
    return math.log(math.exp(margin) + 18) - (margin if is_right else 0.0)


@pytest.mark.parametrize(("gamma", "weights"), [("dynamic", (0.5, 0.5)), (0.7, (0.7, 0.3))])
def test_right_and_wrong_pixels_are_apart(gamma: Any, weights: tuple[float, float]) -> None:
    sample, logits = segmented()
    terms = SemsegObjective(gamma=gamma).terms(Says({"logits": logits}), VIEWS, [sample], [0])
    assert set(terms) == {"correct", "wrong"}
    right = (cost(2.0, is_right=True) + cost(3.0, is_right=True)) / 2
    wrong = (cost(2.0, is_right=False) + cost(3.0, is_right=False)) / 2
    assert float(terms["correct"].value) == pytest.approx(right) and float(terms["wrong"].value) == pytest.approx(wrong)
    assert (terms["correct"].weight, terms["wrong"].weight) == pytest.approx(weights)


def test_a_side_without_weight_or_pixels_is_no_term() -> None:
    sample, logits = segmented()
    assert set(SemsegObjective(gamma=1.0).terms(Says({"logits": logits}), VIEWS, [sample], [0])) == {"correct"}
    all_right = torch.zeros(1, 19, *SHAPE)
    all_right[0, 0] = 1.0
    roads = Labelled(label_ids=np.full(SHAPE, ROAD, np.uint8))
    assert set(SemsegObjective().terms(Says({"logits": all_right}), VIEWS, [roads], [0])) == {"correct"}


def test_a_patch_is_judged_by_the_pixels_that_were_right_without_it() -> None:
    """Roads are right without it; some of them and some of the cars are taken for each other with it."""
    sample, logits = segmented()
    clean = torch.zeros(1, 19, *SHAPE)
    clean[:, 0] = 1.0
    network = Says({"logits": logits}, {"logits": clean})
    road = (cost(2.0, is_right=True) + cost(3.0, is_right=False)) / 2
    car = (cost(2.0, is_right=False) + cost(3.0, is_right=True)) / 2
    harm = SemsegObjective(gamma=0.7).harm(network, VIEWS, [sample], [0])
    assert float(harm) == pytest.approx(0.7 * road + 0.3 * car)
    moving = SemsegObjective()
    terms = moving.terms(network, VIEWS, [sample], [0]).values()
    assert float(moving.harm(network, VIEWS, [sample], [0])) == pytest.approx(
        sum(float(t.weight * t.value) for t in terms)
    )


@pytest.mark.parametrize(
    ("source_class", "values"),
    [(None, ((2.0, False), (2.0, False), (3.0, True), (3.0, True))), (CAR, ((2.0, False), (3.0, True)))],
)
def test_a_target_is_what_pixels_of_the_attacked_class_are_pushed_to(
    source_class: int | None, values: tuple[tuple[float, bool], ...]
) -> None:
    sample, logits = segmented()
    objective = SemsegObjective(source_class=source_class, target=CAR)
    (term,) = objective.terms(Says({"logits": logits}), VIEWS, [sample], [0]).values()
    assert float(term.value) == pytest.approx(-np.mean([cost(m, is_right=r) for m, r in values]))
    assert term.weight == 1.0


def test_depth_is_split_where_the_error_is_small() -> None:
    sample = Deep(surfaces=(surface("left", 0),), depth_m=np.ones(SHAPE))
    clean = torch.full((1, *SHAPE), 10.0)
    said = clean + torch.tensor([[99.0, 0.4, -0.5, 3.0], [99.0, 0.0, 0.6, -2.0]])
    terms = DepthObjective().terms(Says({"depth_m": said}, {"depth_m": clean}), VIEWS, [sample], [0])
    assert float(terms["small"].value) == pytest.approx((0.08 + 0.125 + 0) / 3)
    assert float(terms["large"].value) == pytest.approx((2.5 + 0.18 + 1.5) / 3)
    assert (terms["small"].weight, terms["large"].weight) == pytest.approx((0.8, 0.2))


@pytest.mark.parametrize(("direction", "sign"), [("farther", 1), ("nearer", -1)])
def test_a_direction_is_the_logarithm_of_depth_pushed_that_way(direction: Any, sign: int) -> None:
    sample = Deep(surfaces=(surface("left", 0),), depth_m=np.ones(SHAPE))
    clean = torch.full((1, *SHAPE), 10.0)
    said = clean * torch.tensor([99.0, 2.0, 2.0, 0.5])
    objective = DepthObjective(direction=direction)
    network = Says({"depth_m": said}, {"depth_m": clean})
    (term,) = objective.terms(network, VIEWS, [sample], [0]).values()
    assert float(term.value) == pytest.approx(sign * math.log(2) / 3)
    assert float(objective.harm(network, VIEWS, [sample], [0])) == pytest.approx(sign * math.log(2) / 3)


def test_losses_are_made_large_small_or_left_out_by_their_signs() -> None:
    losses = {name: torch.tensor(value) for name, value in (("a", 1.0), ("b", 2.0), ("c", 3.0))}
    terms = LossObjective(signs={"a": -1.0, "b": 0.0}).terms(Says(losses), VIEWS, [Pictures()], [0])
    assert {name: (float(t.value), t.weight) for name, t in terms.items()} == {"a": (1.0, -1.0), "c": (3.0, 1.0)}


def test_the_ground_truth_says_which_objective_suits() -> None:
    assert isinstance(default_objective(Labelled()), SemsegObjective)
    assert isinstance(default_objective(Deep()), DepthObjective)
    assert default_objective(Pictures()) == LossObjective(signs={})


def test_labels_are_train_ids_or_label_ids_as_the_network_has_them() -> None:
    sample = Labelled(label_ids=np.array([[label.id for label in LABELS]], np.uint8))
    assert train_labels([sample], 19)[0, 0].tolist() == [label.train_id for label in LABELS]
    assert train_labels([sample], 34)[0, 0].tolist() == [label.id if label.is_evaluated else 255 for label in LABELS]
    assert (class_of(CAR, 19), class_of(CAR, 34)) == (13, 26)
    with pytest.raises(ValueError, match="19 train ids"):
        train_labels([sample], 18)


@pytest.mark.parametrize("objective", [SemsegObjective(), SemsegObjective(gamma=0.5), DepthObjective()])
def test_outputs_smaller_than_the_picture_are_an_error(objective: Any) -> None:
    class Coarse:
        def forward(self, views: Mapping[str, Tensor], targets: Any = None) -> Mapping[str, Tensor]:
            return {"logits": torch.zeros(1, 19, 2, 4), "depth_m": torch.ones(1, 2, 4)}

    one = SimpleNamespace(
        images={"left": np.zeros((8, 16, 3), np.uint8)}, surfaces=(), label_ids=np.full((8, 16), CAR, np.uint8)
    )
    with pytest.raises(GearError, match="at the picture's size, 8 x 16, and the network gives 2 x 4"):
        counted(objective, Coarse(), {"left": torch.zeros(1, 3, 8, 16)}, [one], [0])  # type: ignore[arg-type]
