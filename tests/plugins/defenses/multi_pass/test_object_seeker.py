"""ObjectSeeker: promises, masks, and a detector that a patch blinds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from gear.formats.coco import Detection
from gear.plugins.defenses import object_seeker
from gear.plugins.defenses.multi_pass.object_seeker import (
    ObjectSeeker,
    SeekingModel,
    covered_halves,
    partition_points,
)
from gear.plugins.defenses.multi_pass.options import ObjectSeekerConfig
from gear.testing.defense_contract import DefenseContract
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image


class TestObjectSeeker(DefenseContract):
    spec = object_seeker.spec


class Blindable:
    """Finds the white car, unless a red patch is anywhere in the picture."""

    def __init__(self) -> None:
        self.calls = 0

    def predict(self, views: Mapping[str, UInt8Image]) -> tuple[Detection, ...]:
        self.calls += 1
        picture = views["left"].astype(int)
        weak = Detection(category_id=1, box_px=(0.0, 0.0, 2.0, 2.0), score=0.1)
        if ((picture[..., 0] > 200) & (picture[..., 1] < 50)).any():
            return (weak,)
        rows, columns = np.nonzero(picture.min(axis=2) > 200)
        if len(rows) < 30:
            return (weak,)
        left, top, right, bottom = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
        corners = (float(left), float(top), float(right), float(bottom))
        return (weak, Detection(category_id=3, box_px=corners, score=0.95))

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        return {"loss": views["left"].sum()} if targets is not None else {"left": views["left"]}

    def taps(self) -> dict[str, torch.nn.Module]:
        return {}


def street(*, is_patched: bool) -> dict[str, UInt8Image]:
    picture = np.full((60, 120, 3), 100, np.uint8)
    picture[30:50, 20:50] = 255
    if is_patched:
        picture[5:20, 80:100] = (255, 0, 0)
    return {"left": picture}


def test_partition_points_are_those_of_the_authors_code() -> None:
    """ceil(60 / 4) = 15 and ceil(121 / 4) = 31: rows 15, 30, 45 and columns 31, 62, 93."""
    assert partition_points(60, 121, 3) == [(15, 31), (30, 62), (45, 93)]
    assert len(partition_points(800, 1333, 30)) == 30
    assert len(partition_points(5, 5, 30)) == 4


def test_halves_cover_the_picture_twice() -> None:
    covered = np.zeros((6, 8), int)
    for half in covered_halves(2, 3):
        covered[half] += 1
    assert np.all(covered == 2)


def test_an_object_that_a_patch_hides_is_found_again() -> None:
    bare = Blindable()
    model = SeekingModel(bare, ObjectSeekerConfig(lines=5))
    assert len(Blindable().predict(street(is_patched=True))) == 1
    found = model.predict(street(is_patched=True))
    assert bare.calls == 21
    assert [one.category_id for one in found] == [1, 3]
    assert found[1].box_px == (20, 30, 50, 50) and found[1].score == 0.95


def test_without_a_patch_nothing_is_added() -> None:
    picture = street(is_patched=False)
    assert SeekingModel(Blindable(), ObjectSeekerConfig(lines=5)).predict(picture) == Blindable().predict(picture)


@pytest.mark.parametrize("options", [{"masked_confidence": 0.96}, {"base_confidence": 0.0, "prune_share": 0.0}])
def test_confidences_and_shares_decide(options: dict[str, float]) -> None:
    """No box is confident enough, or the weak box explains all."""
    model = SeekingModel(Blindable(), ObjectSeekerConfig(lines=5, **options))
    assert len(model.predict(street(is_patched=True))) == 1


def test_batches_go_to_detectors_that_take_them() -> None:
    class Many(Blindable):
        def predict_many(self, samples: list[Mapping[str, UInt8Image]]) -> list[Any]:
            assert len(samples) == 4
            return [self.predict(sample) for sample in samples]

    settings = ObjectSeekerConfig(lines=5)
    picture = street(is_patched=True)
    assert SeekingModel(Many(), settings).predict(picture) == SeekingModel(Blindable(), settings).predict(picture)


def test_losses_are_means_over_the_whole_and_the_halves() -> None:
    """Each pixel shows in the whole picture and in two of four halves: its gradient is 3 / 5."""
    model = ObjectSeeker(ObjectSeekerConfig()).wrap(Blindable())
    shown = torch.ones(1, 3, 6, 8, requires_grad=True)
    loss = model.forward({"left": shown}, [object()])["loss"]
    assert loss.item() == pytest.approx(3 * 48 * 3 / 5)
    (gradient,) = torch.autograd.grad(loss, shown)
    assert torch.allclose(gradient, torch.full_like(gradient, 0.6))
    assert torch.equal(model.forward({"left": shown})["left"], shown)


def test_taps_are_those_of_the_bare_network() -> None:
    bare = TinySegmenter(TinyConfig())
    assert ObjectSeeker(ObjectSeekerConfig()).wrap(bare).taps().keys() == bare.taps().keys()


@pytest.mark.parametrize(
    "options", [{"lines": 0}, {"masked_confidence": 1.5}, {"base_confidence": -0.1}, {"prune_share": float("nan")}]
)
def test_absurd_options_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        ObjectSeekerConfig(**options)  # type: ignore[arg-type]


def test_it_is_for_detectors_only() -> None:
    assert object_seeker.spec.tasks == ("detect2d",)
