"""Weights, checkpoint and model card are of one state, wherever a training is killed between them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest
from safetensors import safe_open

from gear.dataset import files
from gear.dataset.files import sha256
from gear.values.errors import DatasetError
from gear.verbs.train import loop
from gear.verbs.train.checkpoint import FILE as CHECKPOINT
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.run import TrainReport, train

Street = Callable[..., Path]


class PowerCutError(Exception):
    """The machine stops here."""


def quick(street: Street, out: Path, **changes: Any) -> TrainReport:
    arguments: dict[str, Any] = {"epochs": 3, "batch": 2, "workers": 1, "out": out}
    return train("semseg", "tiny_segmenter", street("semseg"), **(arguments | changes))


def metrics_in(weights: Path) -> dict[str, float]:
    with safe_open(str(weights), framework="pt") as opened:
        found: dict[str, float] = json.loads(opened.metadata()["metrics"])
    return found


def cut_at(monkeypatch: pytest.MonkeyPatch, cut: int) -> None:
    """The `cut`th file that a training writes is never there, nor is anything after it."""
    real, count = files.half_written, [0]

    def write(folder: int, data: bytes) -> AbstractContextManager[str]:
        count[0] += 1
        if count[0] >= cut:
            raise PowerCutError
        return real(folder, data)

    monkeypatch.setattr(files, "half_written", write)


def ranked(monkeypatch: pytest.MonkeyPatch, *metrics: float) -> None:
    """Validations come to these metrics, one after the other."""
    left = list(metrics)
    monkeypatch.setattr(loop, "validate", lambda *_: {"loss": 1.0, "miou": left.pop(0)})


@pytest.mark.parametrize("cut", range(1, 9))
def test_cut_between_any_two_files(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch, cut: int
) -> None:
    """The clock decides which step is validated after the cut: here none of them is as good as the one before it."""
    street("semseg")
    with monkeypatch.context() as patch:
        ranked(patch, 0.1, 0.9, 0.2)
        cut_at(patch, cut)
        with pytest.raises(PowerCutError):
            quick(street, tmp_path / "out")
    with monkeypatch.context() as patch:
        ranked(patch, 0.05, 0.04, 0.03)
        report = quick(street, tmp_path / "out")
    card = (tmp_path / "out" / "card.md").read_text()
    assert metrics_in(report.weights) == report.metrics
    assert f"sha256 `{sha256(report.weights.read_bytes())}`" in card
    assert f"the weights are those after step {report.best_step}" in card
    assert f"| miou | {report.metrics['miou']:.4f} |" in card


def test_a_card_goes_before_the_weights_that_it_describes(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    quick(street, out)
    (out / CHECKPOINT).unlink()
    with monkeypatch.context() as patch:
        cut_at(patch, 3)
        with pytest.raises(PowerCutError):
            quick(street, out, seed=5)
    assert sorted(path.name for path in out.iterdir()) == [CHECKPOINT, "gear", "model.safetensors"]


def test_weights_of_another_training_are_not_taken_for_its_own(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    ranked(monkeypatch, 0.2, 0.1, 0.1, 0.3)
    report = quick(street, out)
    report.weights.write_bytes(quick(street, tmp_path / "other", epochs=1, seed=5).weights.read_bytes())
    with pytest.raises(DatasetError, match=r"model\.safetensors: is not what this training kept; put that back, or"):
        quick(street, out)
    report.weights.unlink()
    with pytest.raises(DatasetError, match=r"is gone; put it back, or delete checkpoint.safetensors"):
        quick(street, out)


def test_missing_best_weights_are_an_error_before_training_continues(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, told = tmp_path / "out", list[int]()
    ranked(monkeypatch, 0.1, 0.3, 0.2, 0.4)

    class StoppedError(Exception): ...

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        told.append(progress.step)
        if len(progress.validations) == 3:
            raise StoppedError

    with pytest.raises(StoppedError):
        quick(street, out, epochs=4, on_step=stop)
    (out / "model.safetensors").unlink()
    told.clear()
    with pytest.raises(DatasetError, match=r"model\.safetensors: is gone; put it back, or delete"):
        quick(street, out, epochs=4, on_step=stop)
    assert not told


def test_the_weights_of_the_last_step_are_made_again(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    ranked(monkeypatch, 0.1, 0.2, math.nan, 0.3)
    report = quick(street, tmp_path / "out", epochs=2)
    there = report.weights.read_bytes()
    report.weights.unlink()
    assert quick(street, tmp_path / "out", epochs=2) == report and report.weights.read_bytes() == there
