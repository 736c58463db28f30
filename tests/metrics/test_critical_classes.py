"""Metrics on critical classes, against counts over single pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from gear.metrics.critical_classes import CRITICAL_LABELS, CriticalClasses
from gear.metrics.semantic import SemanticEvaluator
from gear.plugins.tasks.semseg import SemsegConfig, SemsegTask
from gear.values.rng import derive_rng

CRITICAL_IDS = {19, 20, 24, 25, 26, 27, 28, 31, 32, 33}
EVALUATED_IDS = {7, 8, 11, 12, 13, 17, 21, 22, 23, *CRITICAL_IDS}


@dataclass
class Labelled:
    label_ids: npt.NDArray[np.uint8]

    @property
    def instance_ids(self) -> npt.NDArray[np.uint16]:
        return self.label_ids.astype(np.uint16)


def drawn(seed: int, most: int = 34) -> tuple[Labelled, npt.NDArray[np.uint8]]:
    rng = derive_rng(seed, "critical")
    truth = rng.integers(0, most, (12, 20)).astype(np.uint8)
    wrong = rng.integers(0, 34, truth.shape).astype(np.uint8)
    return Labelled(truth), np.where(rng.random(truth.shape) < 0.5, truth, wrong)


def by_pixels(pairs: list[tuple[Labelled, npt.NDArray[np.uint8]]]) -> dict[str, float]:
    found = total = road = invented = others = 0
    classes: dict[int, list[int]] = {one: [0, 0, 0] for one in CRITICAL_IDS}
    for sample, prediction in pairs:
        for true, said in zip(sample.label_ids.ravel().tolist(), prediction.ravel().tolist(), strict=True):
            if true in CRITICAL_IDS:
                total += 1
                found += true == said
                road += said in (7, 8)
                classes[true][0] += true == said
                classes[true][1] += true != said
            elif true in EVALUATED_IDS:
                others += 1
                invented += said in CRITICAL_IDS
            if true in EVALUATED_IDS and said in CRITICAL_IDS and true != said:
                classes[said][2] += 1
    ious = [hit / (hit + missed + false) for hit, missed, false in classes.values() if hit + missed]
    return {
        "miou": sum(ious) / len(ious), "found_share": found / total, "as_road_share": road / total,
        "invented_share": invented / others,
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_the_metrics_are_counts_of_pixels(seed: int) -> None:
    evaluator, pairs = CriticalClasses(), [drawn(3 * seed + n) for n in range(3)]
    for sample, prediction in pairs:
        assert evaluator.update(sample, prediction) == pytest.approx(by_pixels([(sample, prediction)]))
    result = evaluator.result()
    assert {name: result[name] for name in by_pixels(pairs)} == pytest.approx(by_pixels(pairs))
    merged = CriticalClasses()
    for sample, prediction in pairs:
        part = CriticalClasses()
        part.update(sample, prediction)
        merged.merge(part)
    assert merged.result() == pytest.approx(result, nan_ok=True)


def test_the_classes_are_road_users_and_what_directs_them() -> None:
    assert {label.id for label in CRITICAL_LABELS} == CRITICAL_IDS
    assert "miou" in SemanticEvaluator().result()


def test_a_person_that_becomes_road_is_seen_where_the_mean_hardly_moves() -> None:
    truth = np.full((100, 100), 7, np.uint8)
    truth[:2, :5] = 24
    ours, usual = CriticalClasses(), SemanticEvaluator()
    for one in (ours, usual):
        one.update(Labelled(truth), np.full_like(truth, 7))
    assert ours.result()["as_road_share"] == 1.0 and ours.result()["found_share"] == 0.0
    assert usual.result()["pixel_accuracy"] == 0.999


def test_a_picture_without_these_classes_has_no_share() -> None:
    empty = np.full((4, 4), 7, np.uint8)
    ours = CriticalClasses()
    found = ours.update(Labelled(empty), empty)
    assert math.isnan(found["miou"]) and math.isnan(found["found_share"]) and found["invented_share"] == 0.0


def test_it_is_a_report_of_the_task() -> None:
    report: Any = SemsegTask(SemsegConfig()).reports()["critical"]
    assert isinstance(report, CriticalClasses)
    assert all(report.range_of(name) == (0.0, 1.0) for name in report.result())
