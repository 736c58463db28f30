"""Means over the samples of a dataset."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from gear.verbs.evaluate.compare import drive_note, mask_means, mean_cost
from gear.verbs.evaluate.report import ALARMS


def note(score: float | None = None, mask: dict[str, float] | None = None, seconds: float = 0.0) -> Any:
    return SimpleNamespace(score=score, mask=mask, cost={"model_s": seconds, "defense_s": 2 * seconds})


def test_costs_are_means() -> None:
    assert mean_cost([note(seconds=1.0), note(seconds=3.0)]) == {"model_s": 2.0, "defense_s": 4.0}


def test_masks_are_compared_only_where_there_is_a_patch() -> None:
    notes = [
        note(0.4, {"mask_iou": 0.5, "mask_area": 0.1}),
        note(0.6, {"mask_iou": math.nan, "mask_area": 0.3}),
    ]
    assert mask_means(notes, has_patch=True) == pytest.approx({"mask_iou": 0.5, "mask_area": 0.2, ALARMS: 0.5})
    assert mask_means(notes, has_patch=False) == pytest.approx({"mask_area": 0.2, ALARMS: 0.5})
    assert mask_means([note()], has_patch=True) == {}


def dataset(sequence: int, frame: int) -> Any:
    record = SimpleNamespace(sequence=sequence, frame=frame)
    return type(
        "D", (), {"root": "d", "sidecar": lambda self, index: SimpleNamespace(record=record), "__len__": lambda self: 8}
    )()


def test_frames_of_drives_are_noted() -> None:
    assert drive_note(dataset(7, 0)) is None
    found = drive_note(dataset(1, 3))
    assert found is not None
    assert found.startswith("d: 8 samples are frames of 2 drives")
