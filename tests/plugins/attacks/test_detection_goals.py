"""Vanishing and appearing: what the detector is asked to see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest
import torch
from torch import Tensor

from gear.formats import rle
from gear.plugins.attacks.detection_goals import DetectionGoal
from gear.plugins.attacks.scene_specific import SceneSpecific, SceneSpecificConfig
from gear.plugins.tasks.detect2d import Detect2dConfig, Detect2dSample, Detect2dTask
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import Thing, board, box_part
from gear.values.errors import FieldError, GearError


def sample() -> Detect2dSample:
    task = Detect2dTask(Detect2dConfig(width_px=384, height_px=192))
    car = Thing(parts=(box_part("car", 4.0, 2.0, 1.5),), position_m=(9.0, -4.5, 0.0), object_id=2, role="npc")
    return task.ground_truth(*synthetic_frame(task.rig(), [board(11.0, 2.0), car]))


class Listening:
    """A detector that remembers the labels that it is given."""

    def __init__(self) -> None:
        self.targets: Sequence[Any] = ()

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        self.targets = targets or ()
        return {"classification": views["left"].sum(), "bbox_regression": views["left"].mean()}

    def predict(self, views: Any) -> Any:
        return []

    def taps(self) -> Mapping[str, torch.nn.Module]:
        return {}


def test_an_object_appears_where_the_patch_is_seen() -> None:
    one, model = sample(), Listening()
    terms = DetectionGoal(goal="appear", category_id=3).terms(model, {"left": torch.ones(1, 3, 4, 4)}, [one], [0])
    ((found,),) = [target.objects for target in model.targets]
    (surface,) = one.surfaces
    mask = rle.decode(surface.mask_rle, 192, 384)
    left, top, right, bottom = (int(v) for v in found.box_px)
    assert found.category_id == 3 and not found.is_ignored
    assert mask[top:bottom, left:right].sum() == mask.sum(), "the box holds the whole patch"
    assert mask[:, left].any() and mask[:, right - 1].any() and mask[top].any() and mask[bottom - 1].any()
    assert terms["classification"].value == -48, "losses are to be made small"


def test_everything_vanishes() -> None:
    one, model = sample(), Listening()
    assert one.objects, "there is a car to be hidden"
    DetectionGoal(goal="vanish").terms(model, {"left": torch.ones(1, 3, 4, 4)}, [one], [0])
    assert model.targets[0].objects == () and model.targets[0].images is one.images


def test_goals_are_options_of_the_scene_specific_attack() -> None:
    chosen = SceneSpecific(SceneSpecificConfig(goal="appear", appear_class="car")).objective(sample())
    assert chosen == DetectionGoal(goal="appear", category_id=3)
    with pytest.raises(FieldError, match="COCO"):
        SceneSpecificConfig(goal="appear", appear_class="unicorn")
    stereo = type("Stereo", (), {"images": {}, "objects": ()})()
    with pytest.raises(GearError, match="2D detection"):
        SceneSpecific(SceneSpecificConfig(goal="appear")).objective(stereo)
    assert SceneSpecific(SceneSpecificConfig(goal="vanish")).objective(stereo) == DetectionGoal(goal="vanish")
    with pytest.raises(GearError, match="samples with objects"):
        SceneSpecific(SceneSpecificConfig(goal="vanish")).objective(type("Odd", (), {"images": {}})())


def test_detectors_have_no_pixels_to_share_out() -> None:
    with pytest.raises(GearError, match="option gamma of the attack is for semantic segmentation and depth"):
        SceneSpecific(SceneSpecificConfig(gamma=0.5)).objective(sample())


def test_losses_can_be_left_out_of_a_goal() -> None:
    options = SceneSpecificConfig(goal="vanish", losses={"bbox_regression": "0"})
    objective = SceneSpecific(options).objective(sample())
    terms = objective.terms(Listening(), {"left": torch.ones(1, 3, 4, 4)}, [sample()], [0])
    assert terms.keys() == {"classification"}
    with pytest.raises(GearError, match=r"losses\.classification: goal=vanish makes losses small"):
        SceneSpecific(SceneSpecificConfig(goal="vanish", losses={"classification": "-"})).objective(sample())
