"""Detectors that score the deviation of a feature map from clean pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from gear.plugins.defenses.activations.score_detector import FOLDS, Detector
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import GearError

COUNT = 20


def pictures(count: int) -> list[dict[str, np.ndarray]]:
    rng = np.random.default_rng(3)
    return [{"left": rng.integers(90, 160, (16, 32, 3), dtype=np.uint8)} for _ in range(count)]


def detector(false_alarms: float = 0.1) -> Detector:
    return Detector("", lambda maps: maps.mean((1, 2)), lambda z: z.abs().mean(), false_alarms)


@pytest.fixture(scope="module")
def model() -> Any:
    return TinySegmenter(TinyConfig())


def test_unusual_pictures_score_higher_than_clean_ones(model: Any) -> None:
    rng, clean = np.random.default_rng(0), pictures(COUNT)
    guard = detector()
    state = guard.fit(clean, [], model, rng)
    usual = [guard.apply(views, model, state, rng).score for views in clean]
    odd = guard.apply({"left": np.full((16, 32, 3), 255, np.uint8)}, model, state, rng)
    assert odd.score is not None
    assert odd.score > max(score for score in usual if score is not None)
    assert odd.score > 0.5
    assert (odd.views["left"] == 255).all()
    assert sum(score > 0.5 for score in usual if score is not None) <= 0.1 * COUNT + 1


def test_its_report_has_the_level_and_its_bounds(model: Any) -> None:
    state = detector().fit(pictures(COUNT), [], model, np.random.default_rng(0))
    values = state.fit_report().values
    assert values["clean_pictures"] == COUNT
    assert values["level"] == state.level
    assert 0 <= values["false_alarms_low"] < 0.1 < values["false_alarms_high"] < 1


def test_calibration_reports_both_phases(model: Any) -> None:
    seen: list[tuple[str, int, int]] = []
    guard, clean = detector(), pictures(COUNT)
    state = guard.fit_in_phases(clean, [], model, np.random.default_rng(0), lambda *step: seen.append(step))
    counts = [(done, COUNT) for done in range(1, COUNT + 1)]
    assert seen == [("clean picture", *one) for one in counts] + [("clean score", *one) for one in counts]
    assert state.level == guard.fit(clean, [], model, np.random.default_rng(0)).level


def test_a_batch_has_the_scores_of_its_pictures_and_gradients(model: Any) -> None:
    rng, clean = np.random.default_rng(0), pictures(COUNT)
    guard = detector()
    state = guard.fit(clean, [], model, rng)
    batch = torch.from_numpy(np.stack([views["left"] for views in clean[:2]])).permute(0, 3, 1, 2).float() / 255
    batch.requires_grad_(True)
    found = guard.defend_batch({"left": batch}, model, state)
    assert found.scores is not None
    single = [guard.apply(views, model, state, rng).score for views in clean[:2]]
    assert found.scores.tolist() == pytest.approx(single, rel=1e-4)
    found.scores.sum().backward()
    assert batch.grad is not None
    assert batch.grad.abs().max() > 0


def test_too_few_pictures_are_refused(model: Any) -> None:
    with pytest.raises(GearError, match=f"needs at least {FOLDS} clean pictures; there are 3"):
        detector().fit(pictures(3), [], model, np.random.default_rng(0))
