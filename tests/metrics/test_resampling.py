"""Metrics over resampled pictures, and those that reference networks are held to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from gear.formats.coco import Annotation, Detection, Picture
from gear.formats.kitti_object import KittiLabel, dont_care
from gear.measuring.statistics import gather
from gear.metrics.coco_ap import CocoEvaluator
from gear.metrics.coco_reference import TallObjects
from gear.metrics.depth import DepthEvaluator, NearDepth
from gear.metrics.kitti_ap import KittiEvaluator
from gear.metrics.kitti_reference import NearCars
from gear.metrics.semantic import PresentClasses, SemanticEvaluator
from gear.values.rng import derive_rng

CATEGORIES = (1, 3, 6)


def picture(index: int, height_px: int = 800) -> tuple[Picture, tuple[Detection, ...]]:
    """Boxes, and detections that lie somewhat off, miss, or are too many."""
    rng = derive_rng(3, "picture", index)
    annotations, found = [], []
    for number in range(int(rng.integers(2, 9))):
        left, top = rng.uniform(0, 900), rng.uniform(0, 500)
        width, height = rng.uniform(15, 200), rng.uniform(10, 150)
        category = int(rng.choice(CATEGORIES))
        box = (float(left), float(top), float(width), float(height))
        annotations.append(
            Annotation(
                category_id=category, box_xywh=box, area_px=int(width * height), rle="", is_crowd=number % 5 == 4,
                extras={},
            )
        )  # fmt: skip
        for _ in range(int(rng.integers(0, 3))):
            dx, dy = rng.normal(0, 12, 2)
            edges = (left + dx, top + dy, left + dx + width, top + dy + height)
            found.append(
                Detection(category_id=category, box_px=tuple(map(float, edges)), score=float(rng.uniform(0, 1)))  # type: ignore[arg-type]
            )
    shown = Picture(id=index, file_name="", height_px=height_px, width_px=1333, annotations=tuple(annotations))
    return shown, tuple(found)


def gathered(evaluator: Any, indices: Any) -> Any:
    for index in indices:
        evaluator.update(*picture(int(index)))
    return evaluator


def same(shown: Picture) -> Picture:
    return shown


def test_coco_over_drawn_pictures_is_pycocotools_over_them() -> None:
    draws = np.array([[0, 1, 2, 3, 4, 5], [5, 5, 1, 1, 1, 0], [2, 2, 2, 2, 2, 2]])
    spread = gathered(CocoEvaluator(same), range(6)).resampled(draws)
    assert {"ap", "ap50", "ap75", "ap_person", "ap_car", "ap_bus"} == set(spread)
    for row, drawn in enumerate(draws):
        whole = gathered(CocoEvaluator(same), drawn).result()
        for name in ("ap", "ap50", "ap75"):
            assert spread[name][row] == pytest.approx(whole[name], abs=1e-12), (row, name)
        for name, value in whole.items():
            if name.startswith("ap_") and name in spread:
                assert spread[name][row] == pytest.approx(value, abs=1e-12)
    assert 0.05 < spread["ap"][0] < 0.95


def test_tall_objects_are_pycocotools_without_the_low_ones() -> None:
    """An independent run: only tall labels, detections cut at 32 px unless they lie on a label."""
    evaluator = gathered(TallObjects(same), range(60))
    metrics = evaluator.result()
    counts = {
        name: sum(
            not a.is_crowd and a.box_xywh[3] >= 32 and a.category_id == category
            for i in range(60)
            for a in picture(i)[0].annotations
        )
        for name, category in (("person", 1), ("car", 3), ("bus", 6))
    }
    assert {name: metrics[f"instances_{name}"] for name in counts} == counts
    assert all(count >= 50 for count in counts.values())
    assert np.isnan(metrics["ap50_truck"]) and metrics["instances_truck"] == 0
    assert metrics["ap50"] == pytest.approx(np.mean([metrics[f"ap50_{name}"] for name in counts]))
    spread = evaluator.resampled(np.array([np.arange(60)]))
    assert spread["ap50"][0] == pytest.approx(metrics["ap50"]) and spread["ap50_car"][0] == metrics["ap50_car"]


def test_a_low_label_is_neither_missed_nor_a_false_alarm() -> None:
    tall = Annotation(category_id=3, box_xywh=(0, 0, 50, 60), area_px=1, rle="", is_crowd=False, extras={})
    low = replace(tall, box_xywh=(200.0, 0.0, 50.0, 20.0))
    shown = Picture(id=0, file_name="", height_px=800, width_px=1333, annotations=(tall, low))
    sure = Detection(category_id=3, box_px=(0, 0, 50, 60), score=0.6)

    def ap(found: tuple[Detection, ...], height_px: int = 800) -> float:
        evaluator = TallObjects(same)
        for _ in range(50):
            evaluator.update(replace(shown, height_px=height_px), found)
        return evaluator.result()["ap50_car"]

    assert ap((sure,)) == pytest.approx(1)
    on_low = Detection(category_id=3, box_px=(200, 0, 250, 20), score=0.9)
    assert ap((sure, on_low)) == pytest.approx(1)
    nowhere = Detection(category_id=3, box_px=(500, 0, 550, 20), score=0.9)
    assert ap((sure, nowhere)) == pytest.approx(1), "as low as what is ignored"
    wrong = Detection(category_id=3, box_px=(500, 0, 550, 60), score=0.9)
    assert ap((sure, wrong)) == pytest.approx(0.5)
    assert ap((sure,), height_px=400) == pytest.approx(0.505, abs=0.01), "20 of 400 rows are 40 of 800"

    def single(found: tuple[Detection, ...], height_px: int = 800) -> tuple[float, float]:
        own = TallObjects(same).update(replace(shown, height_px=height_px), found)
        return own["found_share"], own["false_alarms"]

    light = Detection(category_id=10, box_px=(700, 0, 760, 90), score=0.9)  # of no concern to this report
    assert single((sure, on_low, nowhere, light)) == (1, 0)
    assert single((sure, wrong)) == (1, 1)
    assert single((sure,), height_px=400) == (0.5, 0)


def car(ahead_m: float, right_m: float = 0.0, score: float | None = None) -> KittiLabel:
    return KittiLabel(
        type="Car", truncated=0, occluded=0, alpha_rad=0, box_px=(100, 100, 200, 160), height_m=1.5, width_m=1.8,
        length_m=4.2, location_m=(right_m, 1.6, ahead_m), rotation_y_rad=0, score=score,
    )  # fmt: skip


@dataclass(frozen=True)
class Lines:
    labels: tuple[KittiLabel, ...]


def kitti_picture(index: int) -> tuple[Lines, tuple[KittiLabel, ...]]:
    rng = derive_rng(5, "kitti", index)
    labels = [car(float(z), float(x)) for z, x in rng.uniform((5, -10), (70, 10), (6, 2))]
    labels[0] = replace(labels[0], type="Pedestrian")  # of two classes, the mean is over two
    found = [
        replace(
            label, location_m=tuple(np.array(label.location_m) + rng.normal(0, 0.35, 3)), score=float(rng.uniform())
        )
        for label in labels
        if rng.uniform() < 0.8
    ]
    found += [car(float(z), float(x), float(rng.uniform())) for z, x in rng.uniform((5, -10), (70, 10), (2, 2))]
    return Lines((*labels, dont_care((0, 0, 20, 20)))), tuple(found)


def fed(evaluator: Any, indices: Any) -> Any:
    for index in indices:
        evaluator.update(*kitti_picture(int(index)))
    return evaluator


@pytest.mark.parametrize("kind", [KittiEvaluator, NearCars])
def test_kitti_over_drawn_pictures_is_the_evaluation_of_them(kind: Any) -> None:
    draws = np.array([np.arange(12), [3] * 12, [0, 0, 1, 1, 2, 2, 3, 4, 5, 11, 11, 11]])
    spread = fed(kind(lambda one: one.labels), range(12)).resampled(draws)
    for row, drawn in enumerate(draws):
        whole = fed(kind(lambda one: one.labels), drawn).result()
        for name, values in spread.items():
            assert values[row] == pytest.approx(whole[name], nan_ok=True), name
    name = "car_bev_moderate_r40"
    assert 0.05 < spread[name][0] < 0.95


def test_near_cars_ignore_what_is_far() -> None:
    def ap(labels: list[KittiLabel], found: list[KittiLabel]) -> float:
        evaluator = NearCars(lambda one: one.labels)
        for _ in range(60):
            evaluator.update(Lines(tuple(labels)), tuple(found))
        return evaluator.result()["car_bev_moderate_r40"]

    assert ap([car(20), car(50)], [car(20, score=0.9)]) == pytest.approx(1)
    assert ap([car(20), car(50)], [car(20, score=0.9), car(50, score=0.95), car(60, score=0.99)]) == pytest.approx(1)
    assert ap([car(20), car(30)], [car(20, score=0.9)]) == pytest.approx(0.5, abs=0.03)
    assert ap([car(20)], [car(20, 1.3, score=0.9)]) == pytest.approx(1), "0.5 is enough of an overlap"
    assert ap([car(20)], [car(20, 1.5, score=0.9)]) == pytest.approx(0)

    def single(labels: list[KittiLabel], found: list[KittiLabel]) -> tuple[float, float]:
        own = NearCars(lambda one: one.labels).update(Lines(tuple(labels)), tuple(found))
        return own["found_share"], own["false_alarms"]

    walker = replace(car(20, 5), type="Pedestrian", box_px=(300, 100, 320, 160))
    far = car(50, score=0.95)
    assert single([car(20), car(50), walker], [car(20, score=0.9), far, replace(walker, score=0.9)]) == (1, 0)
    assert single([car(20), car(30)], [car(20, score=0.9), car(30, 1.5, score=0.6)]) == (0.5, 1), "seen from above"
    assert single([car(20)], [car(20, score=0.4)]) == (0, 0), "not sure enough"
    assert np.isnan(single([car(50)], [])[0])
    partly, largely = (replace(car(30), occluded=level) for level in (1, 2))
    assert single([car(20), partly, largely], [car(20, score=0.9)]) == (0.5, 0), "of moderate difficulty"


@dataclass(frozen=True)
class Labels:
    label_ids: Any
    instance_ids: Any


def test_absent_classes_are_left_out_and_train_with_them() -> None:
    truth = np.full((10, 10), 7, np.uint8)
    truth[5:] = 8
    said = truth.copy()
    said[0, :5] = 26  # a car that is nowhere
    said[9] = 31
    evaluator = PresentClasses()
    single = evaluator.update(Labels(truth, truth.astype(np.uint16)), said)
    metrics = evaluator.result()
    assert single == {"miou": metrics["miou"]}, "a picture's own metric is the report's, not the benchmark's"
    assert metrics["iou_road"] == pytest.approx(45 / 50) and metrics["iou_sidewalk"] == pytest.approx(40 / 50)
    assert np.isnan(metrics["iou_car"]) and "iou_train" not in metrics
    assert metrics["miou"] == pytest.approx((45 / 50 + 40 / 50) / 2)
    assert len(metrics) == 1 + 18


@dataclass(frozen=True)
class Depths:
    depth_m: Any


def test_near_depth_is_eigens_without_a_crop() -> None:
    rng = derive_rng(1, "depth")
    truth = rng.uniform(2, 160, (20, 30)).astype(np.float32)
    truth[:4] = np.nan
    said = (truth * rng.uniform(0.7, 1.4, truth.shape)).astype(np.float32)
    said[:4] = 500
    near, whole = NearDepth(), DepthEvaluator(max_depth_m=80, crop="none")
    single = near.update(Depths(truth), said)
    whole.update(Depths(truth), said)
    metrics = near.result()
    assert metrics == {n.removeprefix("eigen_"): v for n, v in whole.result().items() if n.startswith("eigen_")}
    known = np.isfinite(truth) & (truth < 80)
    clipped = np.minimum(said[known].astype(float), 80)
    assert metrics["rmse_m"] == pytest.approx(np.sqrt(np.mean((clipped - truth[known]) ** 2)))
    assert single["d1"] == metrics["d1"] and 0.2 < metrics["d1"] < 1


def test_a_single_picture_says_what_was_found_and_what_was_made_up() -> None:
    shown = Picture(
        id=0, file_name="", height_px=100, width_px=200,
        annotations=tuple(
            Annotation(category_id=c, box_xywh=(x, 0.0, 20.0, 20.0), area_px=400, rle="", is_crowd=crowd, extras={})
            for c, x, crowd in ((3, 0.0, False), (3, 50.0, False), (1, 100.0, False), (3, 150.0, True))
        ),
    )  # fmt: skip

    def det(category: int, left: float, score: float) -> Detection:
        return Detection(category_id=category, box_px=(left, 0, left + 20, 20), score=score)

    found = (
        det(3, 2, 0.9),  # the first car
        det(3, 0, 0.8),  # it again: made up
        det(3, 52, 0.4),  # not sure enough
        det(3, 100, 0.7),  # a person is no car: made up
        det(1, 104, 0.6),  # the person
        det(3, 151, 0.9),  # ignored
    )
    assert CocoEvaluator(same).update(shown, found) == {"found_share": pytest.approx(2 / 3), "false_alarms": 2}
    assert NearCars(lambda one: one.labels).update(Lines((car(20),)), (car(20, score=0.7),)) == {
        "found_share": 1, "false_alarms": 0,
    }  # fmt: skip
    empty = CocoEvaluator(same).update(replace(shown, annotations=()), ())
    assert np.isnan(empty["found_share"]) and empty["false_alarms"] == 0


@pytest.mark.parametrize("metric", [SemanticEvaluator, PresentClasses])
def test_sums_over_draws_are_what_merging_comes_to(metric: type[SemanticEvaluator]) -> None:
    """Four pictures with few classes each: in many draws some class is not there at all."""
    rng, parts = derive_rng(2, "sums"), []
    for classes in ([7, 26, 24], [7, 8, 26], [8, 11, 33, 32], [23]):
        truth = rng.choice(np.array(classes, np.uint8), (12, 16))
        said = np.where(rng.random(truth.shape) < 0.7, truth, rng.choice([7, 8, 26, 31], truth.shape)).astype(np.uint8)
        instances = np.where(truth >= 24, truth.astype(np.uint16) * 1000 + 3, truth).astype(np.uint16)
        parts.append(metric())
        parts[-1].update(Labels(truth, instances), said)
    _same_as_merging(metric, parts)


@pytest.mark.parametrize("metric", [DepthEvaluator, NearDepth])
def test_means_over_draws_are_what_merging_comes_to(metric: type[DepthEvaluator]) -> None:
    """One of the four pictures has no ground truth nearer than 80 m."""
    rng, parts = derive_rng(2, "means"), []
    for far in (0, 0, 100, 0):
        truth = (far + rng.uniform(2, 60, (10, 12))).astype(np.float32)
        parts.append(metric())
        parts[-1].update(Depths(truth), (truth * rng.uniform(0.7, 1.4, truth.shape)).astype(np.float32))
    _same_as_merging(metric, parts)


def _same_as_merging(metric: Any, parts: list[Any]) -> None:
    drawn = derive_rng(0, "draws").integers(0, len(parts), (30, len(parts)))
    draws = np.concatenate([drawn, np.full((1, len(parts)), 2), np.full((1, len(parts)), 3)])
    quick = gather(metric, parts, draws)
    assert set(quick.replicates) == set(quick.overall)
    for number, drawn in enumerate(draws):
        one = metric()
        for index in drawn:
            one.merge(parts[index])
        for name, value in one.result().items():
            assert quick.replicates[name][number] == pytest.approx(value, nan_ok=True), (name, number)
