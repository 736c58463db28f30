"""The report `objects`: what it counts in each picture, and that sums and merging say the same."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gear.formats.coco import Detection
from gear.measuring.object_report import ObjectEvaluator
from gear.measuring.patch_area import patch_masks
from gear.plugins.tasks.detect2d import Detect2dConfig, Detect2dTask
from gear.testing.synthetic import synthetic_frame

TASK = Detect2dTask(Detect2dConfig(width_px=667, height_px=400))


def pairs() -> list[tuple[Any, tuple[Detection, ...]]]:
    """Three pictures; the first objects are lost, and what is made up lies on the patch, aside, or on an object."""
    found = []
    for index in range(3):
        sample = TASK.ground_truth(*synthetic_frame(TASK.rig(), index=index, seed=5))
        rows, columns = np.nonzero(patch_masks(sample)["left"])
        board = (float(columns.min()), float(rows.min()), float(columns.max() + 1), float(rows.max() + 1))
        truth = TASK.as_prediction(sample)
        aside = Detection(category_id=73, box_px=(600.0, 380.0, 640.0, 400.0), score=0.6)
        on_it = replace(aside, box_px=board)
        found.append((sample, (*truth[index:], *([on_it] * index), aside, replace(truth[-1], score=0.7))))
    return found


def test_false_alarms_on_the_patch_and_elsewhere_are_all_false_alarms() -> None:
    whole, parts = ObjectEvaluator(TASK), []
    assert all(math.isnan(value) for value in whole.result().values())
    for index, (sample, prediction) in enumerate(pairs()):
        part, single = ObjectEvaluator(TASK), TASK.evaluator()
        metrics, reference = part.update(sample, prediction), single.update(sample, prediction)
        assert (metrics["false_alarms_on_patch"], metrics["false_alarms_elsewhere"]) == (index, 2)
        assert index + 2 == reference["false_alarms"]
        assert metrics["found_share"] == reference["found_share"] == pytest.approx(1 - metrics["missed_share"])
        whole.merge(part)
        parts.append(part)
    result = whole.result()
    assert (result["false_alarms_on_patch"], result["false_alarms_elsewhere"]) == (1, 2)
    draws = [(0, 0, 2), (1, 2, 2)]
    totals = np.array([sum(parts[i].totals()["counts"] for i in row) for row in draws])
    spread = whole.metrics({"counts": totals})
    for number, row in enumerate(draws):
        merged = ObjectEvaluator(TASK)
        for i in row:
            merged.merge(parts[i])
        assert {name: values[number] for name, values in spread.items()} == pytest.approx(merged.result())
    assert whole.range_of("found_share") == (0, 1) and whole.range_of("false_alarms_on_patch") == (0, math.inf)


def test_distances_are_those_of_the_scene() -> None:
    """In metres between the middles of object and patch; found from the box and the distance of each object."""
    sample, prediction = pairs()[0]
    evaluator = ObjectEvaluator(TASK)
    evaluator.update(sample, prediction)
    camera_from_world = sample.record.camera("left").world_from_camera_transform.inverse()
    surface = sample.record.world_from_surface(sample.record.surfaces[0])
    patch_m = camera_from_world.apply(surface.translation_m)
    (picture,) = evaluator.pictures
    checked = 0
    for thing in picture.objects:
        actor = next((actor for actor in sample.record.actors if actor.id == thing.object_id), None)
        if actor is not None and thing.patch.metres is not None:
            base_m = camera_from_world.apply(actor.world_from_actor.transform("world", "actor").translation_m)
            assert thing.patch.metres == pytest.approx(float(np.linalg.norm(base_m - patch_m)), abs=1.5)
            checked += 1
    assert checked >= 3
