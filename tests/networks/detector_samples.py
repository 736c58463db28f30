"""Samples of 2D detection whose objects are large enough for small pictures."""

from __future__ import annotations

from typing import Any

from gear.groundtruth.visibility import Visibility
from gear.plugins.tasks.detect2d import Detect2dConfig, Detect2dSample, Detect2dTask
from gear.testing.synthetic import synthetic_frame

LIMITS = Visibility(preset="carla_gear", min_box_area_px2=60.0, min_visible_px=10)
SMALL: dict[str, Any] = {"width_px": 128, "height_px": 64, "visibility": LIMITS}


def street_samples(width_px: int, height_px: int, count: int = 2) -> list[Detect2dSample]:
    """Synthetic streets; every one has labelled and ignored objects."""
    task = Detect2dTask(Detect2dConfig(width_px=width_px, height_px=height_px, visibility=LIMITS))
    samples = [task.ground_truth(*synthetic_frame(task.rig(), index=i, seed=5)) for i in range(count)]
    assert all({thing.is_ignored for thing in sample.objects} == {True, False} for sample in samples)
    return samples
