"""The scene-specific attack, on tiny networks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import pytest
import torch

from gear.contracts.attacks import Patch
from gear.plugins.attacks.carla_gear import carla_gear
from gear.plugins.attacks.optimisation.objectives import SemsegObjective
from gear.plugins.attacks.optimisation.settings import Settings
from gear.plugins.attacks.scene_specific import SceneSpecific, SceneSpecificConfig, scene_specific
from gear.testing.attack_contract import AttackContract, Counted
from gear.testing.tiny_compositor import TinyCompositor
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError

SMALL = {"height_px": 16, "width_px": 32}


class TestOnSemseg(AttackContract):
    spec = scene_specific
    options = SMALL
    steps = 40


class TestOnDepth(AttackContract):
    spec = scene_specific
    options = SMALL
    task = "depth"


class TestOneGradientForAllTerms(AttackContract):
    spec = scene_specific
    options: ClassVar[Mapping[str, Any]] = {**SMALL, "per_term": False, "printability": 0.2}
    steps = 40


class TestThePapers(AttackContract):
    spec = carla_gear
    options = SMALL
    steps = 40

    def model(self) -> Counted:
        """One that is right about buildings: the paper's attack looks at pixels that are still right."""
        model = super().model()
        with torch.no_grad():
            model.network.head.bias[11] += 6.0
        return model

    def harm(self, model: Counted, dataset: Sequence[Any], patches: Sequence[Patch]) -> float:
        """Cross-entropy beside the patch, where the paper's loss looks."""
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        pictures = TinyCompositor(dataset).compose(tensors, range(len(dataset)), "left")
        with torch.no_grad():
            return sum(
                float(t.value)
                for t in SemsegObjective(gamma=1.0).terms(model, {"left": pictures}, dataset, [0, 1]).values()
            )


class TestThePapersOnDepth(AttackContract):
    spec = carla_gear
    options = SMALL
    task = "depth"


@pytest.mark.parametrize(("direction", "grows"), [("farther", True), ("nearer", False)])
def test_depth_goes_where_it_is_pushed(direction: str, grows: bool) -> None:
    class Contract(AttackContract):
        spec = scene_specific
        options: ClassVar[Mapping[str, Any]] = {**SMALL, "direction": direction}
        task = "depth"

    contract = Contract()
    model, dataset = contract.model(), contract.dataset()

    def mean_log_depth(patches: Sequence[Patch]) -> float:
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        pictures = TinyCompositor(dataset).compose(tensors, range(len(dataset)), "left")
        with torch.no_grad():
            return float(model.forward({"left": pictures})["depth_m"].log().mean())

    start = mean_log_depth(contract.attack(model, dataset, steps=1))
    end = mean_log_depth(contract.attack(model, dataset, steps=30))
    assert (end > start) == grows


@pytest.mark.parametrize(("task", "rate"), [("depth", 0.25), ("semseg", 0.06)])
def test_steps_are_as_large_as_the_task_wants(task: str, rate: float) -> None:
    """Unless the user says how large."""

    class Contract(AttackContract):
        spec = scene_specific

    Contract.task = task
    sample = Contract().dataset()[0]
    assert SceneSpecific(SceneSpecificConfig()).settings(sample).learning_rate == rate
    assert SceneSpecific(SceneSpecificConfig(learning_rate=0.1)).settings(sample).learning_rate == 0.1
    assert Settings(learning_rate=None).rate == Settings().rate == 0.06


class WithLosses(TinySegmenter):
    """A tiny network with two losses."""

    def forward(self, views: Any, targets: Any | None = None) -> Any:
        given = super().forward(views)
        mean = given["logits"].mean()
        return given if targets is None else {"one": mean, "two": -mean}


def test_names_of_losses_are_those_of_the_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gear.plugins.attacks.optimisation.objectives.kind_of", lambda sample: "losses")

    class Contract(AttackContract):
        spec = scene_specific
        options: ClassVar[Mapping[str, Any]] = {**SMALL, "losses": {"two": "0"}}

    contract = Contract()
    assert len(contract.attack(WithLosses(TinyConfig()), contract.dataset(), steps=1)) == 1
    Contract.options = {**SMALL, "losses": {"one": "0", "two": "0"}}
    with pytest.raises(GearError, match="all of one, two are left out"):
        contract.attack(WithLosses(TinyConfig()), contract.dataset(), steps=1)
    Contract.options = {**SMALL, "losses": {"tow": "0"}}
    with pytest.raises(GearError, match=r"losses.tow: no loss of the model; it has one, two"):
        contract.attack(WithLosses(TinyConfig()), contract.dataset(), steps=1)


def test_a_class_becomes_another() -> None:
    class Contract(AttackContract):
        spec = scene_specific
        options: ClassVar[Mapping[str, Any]] = {**SMALL, "source_class": "building", "target": "road"}

    contract = Contract()
    model, dataset = contract.model(), contract.dataset()
    road = []
    for steps in (1, 30):
        patches = contract.attack(model, dataset, steps=steps)
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        pictures = TinyCompositor(dataset).compose(tensors, range(len(dataset)), "left")
        with torch.no_grad():
            probability = model.forward({"left": pictures})["logits"].softmax(1)[:, 7]
        building = torch.from_numpy(np.stack([sample.label_ids == 11 for sample in dataset]))
        road.append(float(probability[building].mean()))
    assert road[1] > road[0]


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"learning_rate": 0.0}, "learning_rate"),
        ({"gamma": 1.5}, "gamma"),
        ({"target": "rode"}, "target"),
        ({"source_class": "car"}, "target"),
        ({"appear_class": "car"}, "appear_class"),
        ({"appear_class": "car", "goal": "vanish"}, "appear_class"),
        ({"losses": {"bbox_regression": "x"}}, "losses.bbox_regression"),
    ],
)
def test_bad_options_are_refused(options: dict[str, object], what: str) -> None:
    with pytest.raises(FieldError, match="must") as caught:
        SceneSpecificConfig(**options)  # type: ignore[arg-type]
    assert caught.value.field == what
