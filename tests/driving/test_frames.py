"""Frames of drives as data of attacks: their weights, and the draw."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gear.driving.frames import LEAST_WEIGHT, RecordedScenes, WeightedFrame, drawn_frames, frame_weight


def situation(speed_mps: float, s_m: float) -> Any:
    return SimpleNamespace(
        ego=SimpleNamespace(speed_mps=speed_mps),
        position=SimpleNamespace(s_m=s_m),
        car=SimpleNamespace(most_braking_mps2=8.0),
    )


def test_frames_within_the_braking_distance_matter_most() -> None:
    assert frame_weight(situation(16.0, 0.0), 16.0) == 1.0, "16 m is the braking distance at 16 m/s and 8 m/s²"
    assert frame_weight(situation(16.0, 0.0), 32.0) == pytest.approx(0.5)
    assert frame_weight(situation(16.0, 40.0), 32.0) == 1.0
    assert frame_weight(situation(0.0, 0.0), 32.0) == LEAST_WEIGHT
    assert frame_weight(situation(16.0, 0.0), math.inf) == 1.0


def test_frames_are_drawn_by_weight_in_order_and_once() -> None:
    frames: Any = [WeightedFrame(record=number, weight=1.0 if number >= 50 else 0.1) for number in range(100)]  # type: ignore[arg-type]
    drawn: Any = drawn_frames(frames, 30, np.random.default_rng(0))
    assert drawn == sorted(set(drawn)) and len(drawn) == 30
    assert sum(number >= 50 for number in drawn) > 20
    assert drawn_frames(frames, 100, np.random.default_rng(0)) == list(range(100))
    assert RecordedScenes(records=drawn).plan(3) == drawn[3]
