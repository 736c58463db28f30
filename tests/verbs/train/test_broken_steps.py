"""Steps and answers that come to no number: left out, counted, and said in a line."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.models import Recipe
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.train import loop
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.run import TrainReport, train

Street = Callable[..., Path]


class StopError(Exception):
    """A power cut."""


def quick(street: Street, out: Path, **changes: Any) -> TrainReport:
    arguments: dict[str, Any] = {"epochs": 3, "batch": 2, "workers": 1, "out": out}
    return train("semseg", "tiny_segmenter", street("semseg"), **(arguments | changes))


class Overflowing(TinySegmenter):
    """Its loss is no number."""

    def loss(self, raw: torch.Tensor, targets: Any) -> torch.Tensor:
        return super().loss(raw, targets) * float("nan")


class Cropping(TinySegmenter):
    def predict(self, views: Any) -> Any:
        return super().predict(views)[1:]


class Normalising(TinySegmenter):
    """Normalises what is left of a picture in one cell, as the context of DDRNet does."""

    def __init__(self, config: TinyConfig) -> None:
        super().__init__(config)
        self.context = torch.nn.BatchNorm2d(3)

    def forward(self, views: Any, targets: Any = None) -> Any:
        self.context(views["left"].mean((2, 3), keepdim=True))
        return super().forward(views, targets)


def test_a_batch_of_one_that_cannot_be_normalised_is_said(street: Street, tmp_path: Path, install: Any) -> None:
    install(replace(tiny_segmenter, build=Normalising))
    with pytest.raises(GearError, match="with --batch 2 or more"):
        quick(street, tmp_path / "out", batch=1)
    assert quick(street, tmp_path / "two", batch=2, epochs=1).steps == 2


def test_a_loss_that_is_no_number_ends_it(street: Street, tmp_path: Path, install: Any) -> None:
    install(replace(tiny_segmenter, build=Overflowing, recipe=Recipe(batch=1, epochs=9)))
    with pytest.raises(GearError, match=r"loss is nan .* lower --lr"):
        quick(street, tmp_path / "out", epochs=30, batch=1)


class Unlabelled(TinySegmenter):
    """Finds nothing to learn from, now and then or ever: its loss is no number, and its gradients are zero."""

    def __init__(self, config: TinyConfig, every: int) -> None:
        super().__init__(config)
        self.every, self.steps = every, 0

    def loss(self, raw: torch.Tensor, targets: Any) -> torch.Tensor:
        self.steps += self.training
        if self.steps % self.every:
            return super().loss(raw, targets)
        return torch.nn.functional.cross_entropy(raw, torch.full_like(raw[:, 0], 255).long(), ignore_index=255)


def test_a_loss_that_is_no_number_is_left_out_whatever_its_gradients_are(
    street: Street, tmp_path: Path, install: Any
) -> None:
    install(replace(tiny_segmenter, build=lambda config: Unlabelled(config, 5), recipe=Recipe(batch=1, epochs=9)))
    quick(street, tmp_path / "some", epochs=4, batch=1)
    history = json.loads((tmp_path / "some" / "train.json").read_text(), parse_constant=float)
    assert [np.isfinite(point["loss"]) for point in history["steps"]] == [True, True]
    install(replace(tiny_segmenter, build=lambda config: Unlabelled(config, 1), recipe=Recipe(batch=1, epochs=9)))
    with pytest.raises(GearError, match=r"loss is nan .* lower --lr"):
        quick(street, tmp_path / "all", epochs=30, batch=1)


def test_steps_that_are_left_out_are_counted_over_a_stop(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(loop, "CHECKPOINT_EVERY_S", 0.0)
    install(replace(tiny_segmenter, build=Overflowing, recipe=Recipe(batch=1, epochs=9)))

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        if progress.step == 13:
            raise StopError

    with pytest.raises(StopError):
        quick(street, tmp_path / "out", epochs=30, batch=1, on_step=stop)
    with pytest.raises(GearError, match="21 steps in a row, at step 20;"):
        quick(street, tmp_path / "out", epochs=30, batch=1)


def test_a_rate_that_optimisers_have_no_number_for_is_refused(street: Street, tmp_path: Path, install: Any) -> None:
    install(tiny_segmenter)
    with pytest.raises(GearError, match="learning_rate: must be above 0, at most 1e"):
        quick(street, tmp_path, settings=["learning_rate=1e39"])


def test_answers_that_cannot_be_measured_end_it(street: Street, tmp_path: Path, install: Any) -> None:
    install(replace(tiny_segmenter, build=Cropping, recipe=Recipe(batch=1, epochs=9)))
    with pytest.raises(GearError, match=r"validation picture \(prediction must have shape .* lower --lr"):
        quick(street, tmp_path / "out")
