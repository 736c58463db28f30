"""KITTI's evaluation against a second one, written with plain loops and shapely from the rules alone."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from gear.formats.kitti_object import KittiLabel, dont_care, label_corners
from gear.metrics.kitti_ap import KittiEvaluator, perfect_curve
from gear.metrics.kitti_match import DIFFICULTIES, choose, count, matched_scores, picture_boxes
from gear.metrics.kitti_reference import NearCars
from gear.values.ground_truth import BoxPx

LEVELS = {"easy": (40, 0, 0.15), "moderate": (25, 1, 0.3), "hard": (25, 2, 0.5)}
NEIGHBOUR = {"Car": "Van", "Pedestrian": "Person_sitting", "Cyclist": None}
OVERLAP = {"Car": 0.7, "Pedestrian": 0.5, "Cyclist": 0.5}
Picture = tuple[list[KittiLabel], list[KittiLabel]]


def overlap_of(a: KittiLabel, b: KittiLabel, kind: str) -> float:
    if kind == "2d":
        first, second = shapely.box(*a.box_px), shapely.box(*b.box_px)
        return float(first.intersection(second).area / first.union(second).area)
    first, second = (shapely.Polygon(label_corners(c)[:4, [0, 2]]) for c in (a, b))
    shared = first.intersection(second).area
    if kind == "bev":
        return float(shared / first.union(second).area)
    height = min(a.location_m[1], b.location_m[1]) - max(a.location_m[1] - a.height_m, b.location_m[1] - b.height_m)
    volume = shared * max(0.0, height)
    return float(volume / (first.area * a.height_m + second.area * b.height_m - volume))


def steps_of_recall(scores: Sequence[float], wanted: int) -> list[float]:
    """The scores at which recall is as near to the next of 41 steps as it comes; `scores` falls."""
    steps: list[float] = []
    for i, score in enumerate(scores):
        here, last = (i + 1) / wanted, i == len(scores) - 1
        after = here if last else (i + 2) / wanted
        step = len(steps) / 40
        if last or after - step >= step - here:
            steps.append(score)
    return steps


class BruteForce:
    """The devkit's two passes for one class, level and overlap."""

    def __init__(
        self, pictures: Sequence[Picture], name: str, level: str, kind: str, ignored_px: Sequence[BoxPx] = ()
    ) -> None:
        self.name, self.kind, self.least = name, kind, OVERLAP[name]
        self.min_height, self.max_occluded, self.max_truncated = LEVELS[level]
        self.pictures, self.ignored_px = pictures, ignored_px

    def label_role(self, label: KittiLabel) -> str:
        if label.type == self.name:
            hard = (
                label.occluded > self.max_occluded
                or label.truncated > self.max_truncated
                or label.box_px[3] - label.box_px[1] <= self.min_height
            )
            return "ignored" if hard else "wanted"
        return "ignored" if label.type == NEIGHBOUR[self.name] else "none"

    def found_role(self, found: KittiLabel) -> str:
        if int(found.box_px[3] - found.box_px[1]) < self.min_height:
            return "ignored"
        return "wanted" if found.type == self.name else "none"

    def match(self, labels: list[KittiLabel], detections: list[KittiLabel], threshold: float | None) -> dict[str, Any]:
        regions = [label for label in labels if label.type == "DontCare"]
        taken: set[int] = set()
        tp = fn = 0
        scores, similarity = [], 0.0
        usable = [j for j, d in enumerate(detections) if threshold is None or d.score >= threshold]
        for label in labels:
            role = self.label_role(label) if label.type != "DontCare" else "none"
            if role == "none":
                continue
            best, best_value, best_ignored = None, -math.inf, False
            for j in usable:
                if j in taken or self.found_role(detections[j]) == "none":
                    continue
                overlap = overlap_of(label, detections[j], self.kind)
                if overlap <= self.least:
                    continue
                ignored = self.found_role(detections[j]) == "ignored"
                if threshold is None:
                    if detections[j].score > best_value:
                        best, best_value, best_ignored = j, detections[j].score, ignored
                elif not ignored and (overlap > best_value or best_ignored):
                    best, best_value, best_ignored = j, overlap, False
                elif ignored and best is None:
                    best, best_ignored = j, True
            if best is None:
                fn += role == "wanted"
            elif role == "ignored" or best_ignored:
                taken.add(best)
            else:
                tp += 1
                taken.add(best)
                scores.append(detections[best].score)
                similarity += (1 + math.cos(label.alpha_rad - detections[best].alpha_rad)) / 2
        fp = 0
        for j in usable:
            if j in taken or self.found_role(detections[j]) != "wanted":
                continue
            own = shapely.box(*detections[j].box_px)
            boxes = [region.box_px for region in regions] if self.kind == "2d" else []
            shares = [own.intersection(shapely.box(*box)).area / own.area for box in (*boxes, *self.ignored_px)]
            fp += not any(share > self.least for share in shares)
        return {"tp": tp, "fp": fp, "fn": fn, "scores": scores, "similarity": similarity}

    def curves(self) -> tuple[list[float], list[float]]:
        wanted = sum(self.label_role(label) == "wanted" for labels, _ in self.pictures for label in labels)
        if not wanted:
            return [math.nan] * 41, [math.nan] * 41
        scores = sorted((s for p in self.pictures for s in self.match(*p, None)["scores"]), reverse=True)
        precision, orientation = [0.0] * 41, [0.0] * 41
        for t, threshold in enumerate(steps_of_recall(scores, wanted)):
            counts = [self.match(*p, threshold) for p in self.pictures]
            total = sum(c["tp"] + c["fp"] for c in counts)
            precision[t] = sum(c["tp"] for c in counts) / total
            orientation[t] = sum(c["similarity"] for c in counts) / total
        return (
            [max(precision[i:]) for i in range(41)],
            [max(orientation[i:]) for i in range(41)],
        )


def label(kind: str, rng: np.random.Generator) -> KittiLabel:
    left, top = rng.uniform(0, 1000), rng.uniform(100, 200)
    height = float(rng.choice([25.0, 40.0, rng.uniform(15, 120), rng.uniform(15, 120)]))
    return KittiLabel(
        type=kind,
        truncated=float(rng.choice([0.0, 0.0, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6])),
        occluded=int(rng.integers(0, 3)),
        alpha_rad=float(rng.uniform(-3, 3)),
        box_px=(left, top, left + rng.uniform(20, 120), top + height),
        height_m=1.5,
        width_m=1.7,
        length_m=4.0,
        location_m=(float(rng.uniform(-12, 12)), 1.65, float(rng.uniform(6, 40))),
        rotation_y_rad=float(rng.uniform(-3, 3)),
    )


def picture(seed: int) -> Picture:
    """Labels of all sorts, one doubled, and detections near them, twice, mistyped, tiny, made up, or of no concern."""
    rng = np.random.default_rng(seed)
    kinds = ["Car", "Car", "Car", "Van", "Pedestrian", "Pedestrian", "Person_sitting", "Cyclist", "Truck"]
    labels = [label(kind, rng) for kind in kinds for _ in range(int(rng.integers(0, 3)))]
    found = []
    for thing in labels:
        for _ in range(int(rng.integers(0, 3))):
            shift = rng.normal(0, 0.15, 3)
            kind = thing.type if rng.random() < 0.9 and thing.type in NEIGHBOUR else "Car"
            moved = tuple(v + d for v, d in zip(thing.box_px, rng.normal(0, 2, 4), strict=True))
            place = tuple(v + d for v, d in zip(thing.location_m, shift, strict=True))
            found.append(replace(thing, type=kind, box_px=moved, location_m=place, score=float(rng.uniform(0, 1)),
                                 alpha_rad=thing.alpha_rad + float(rng.normal(0, 0.4))))  # fmt: skip
    found += [replace(label("Car", rng), score=float(rng.uniform(0, 1))) for _ in range(3)]
    if labels:  # one detection may fit both, and finds one
        labels.append(replace(labels[0], alpha_rad=labels[0].alpha_rad + 1))
    if found:
        left, top, right, bottom = found[-1].box_px
        labels.append(dont_care((left - 5, top - 5, right + 5, bottom + 5)))
    return labels, found


def evaluate(pictures: Sequence[Picture], ignored_px: Sequence[BoxPx] = ()) -> dict[str, float]:
    evaluator: KittiEvaluator[list[KittiLabel]] = KittiEvaluator(lambda labels: labels, lambda _: ignored_px)
    for labels, found in pictures:
        evaluator.update(labels, found)
    return dict(evaluator.result())


@pytest.mark.parametrize("seed", [0, 1])
def test_agrees_with_the_second_evaluator(seed: int) -> None:
    pictures = [picture(100 * seed + i) for i in range(12)]
    result = evaluate(pictures)
    for name in NEIGHBOUR:
        for kind in ("2d", "bev", "3d"):
            for level in LEVELS:
                precision, orientation = BruteForce(pictures, name, level, kind).curves()
                stem = f"{name.lower()}_{kind}_{level}"
                assert result[f"{stem}_r40"] == pytest.approx(np.mean(precision[1:]), abs=1e-9, nan_ok=True), stem
                assert result[f"{stem}_r11"] == pytest.approx(np.mean(precision[::4]), abs=1e-9, nan_ok=True), stem
                if kind == "2d":
                    aos = f"{name.lower()}_aos_{level}_r40"
                    assert result[aos] == pytest.approx(np.mean(orientation[1:]), abs=1e-9, nan_ok=True), aos
    assert 0.05 < result["car_2d_hard_r40"] < 0.999


IGNORED = ((0.0, 80.0, 400.0, 240.0), (700.0, 150.0, 1000.0, 300.0))


def test_ignored_boxes_excuse_detections_of_every_overlap() -> None:
    """As a DontCare region does in the picture, and from above and in space, too."""
    pictures = [picture(300 + i) for i in range(12)]
    plain, silent = evaluate(pictures), evaluate(pictures, IGNORED)
    for name in NEIGHBOUR:
        for kind in ("2d", "bev", "3d"):
            precision, _ = BruteForce(pictures, name, "moderate", kind, IGNORED).curves()
            stem = f"{name.lower()}_{kind}_moderate_r40"
            assert silent[stem] == pytest.approx(np.mean(precision[1:]), abs=1e-9, nan_ok=True), stem
    for kind in ("2d", "bev", "3d"):
        assert silent[f"car_{kind}_hard_r40"] > plain[f"car_{kind}_hard_r40"]
    regions = [([*labels, *map(dont_care, IGNORED)], found) for labels, found in pictures]
    described = evaluate(regions)
    for name in NEIGHBOUR:
        assert silent[f"{name.lower()}_2d_hard_r40"] == described[f"{name.lower()}_2d_hard_r40"]


CAR = KittiLabel(
    type="Car",
    truncated=0,
    occluded=0,
    alpha_rad=0.5,
    box_px=(100, 100, 200, 160),
    height_m=1.5,
    width_m=1.8,
    length_m=4.2,
    location_m=(1.0, 1.65, 12.0),
    rotation_y_rad=0.4,
)


def test_ground_truth_is_perfect_once_there_are_forty() -> None:
    result = evaluate([([CAR], [replace(CAR, score=1.0)])] * 60)
    for name in ("car_2d_easy", "car_3d_moderate", "car_bev_hard", "car_aos_moderate"):
        assert result[f"{name}_r11"] == result[f"{name}_r40"] == 1.0
    assert math.isnan(result["pedestrian_2d_easy_r40"])
    assert result["ap_3d_moderate"] == 1.0


@pytest.mark.parametrize("cars", [1, 2, 3, 17, 40, 41])
@pytest.mark.parametrize("kind", [KittiEvaluator, NearCars])
def test_the_ceiling_is_the_metric_of_the_ground_truth(cars: int, kind: type[KittiEvaluator[Any]]) -> None:
    evaluator = kind(lambda labels: labels)
    for number in range(cars):
        evaluator.update([CAR], [replace(CAR, score=1 - number / 100)])
    ceilings = evaluator.ceilings()
    assert ceilings == {name: value for name, value in evaluator.result().items() if value < 1}
    metric = "car_bev_moderate_r40"
    assert ceilings.get(metric, 1.0) == pytest.approx((cars - 1) / 40)


def test_half_found_is_half_as_good() -> None:
    result = evaluate([([CAR], [replace(CAR, score=1.0)]), ([CAR], [])] * 50)
    assert result["car_3d_moderate_r40"] == pytest.approx(0.5, abs=0.026)


def test_turned_round_halves_nothing_but_orientation() -> None:
    result = evaluate([([CAR], [replace(CAR, score=1.0, alpha_rad=CAR.alpha_rad + math.pi)])] * 60)
    assert result["car_2d_moderate_r40"] == 1.0
    assert result["car_aos_moderate_r40"] == pytest.approx(0.0, abs=1e-9)


def test_a_van_counts_neither_way_and_a_truck_counts_against() -> None:
    found = [replace(CAR, score=1.0)]
    van, truck = replace(CAR, type="Van"), replace(CAR, type="Truck")
    good = [([CAR], found)] * 60
    assert evaluate([*good, *[([van], found)] * 60])["car_2d_moderate_r40"] == 1.0
    assert evaluate([*good, *[([truck], found)] * 60])["car_2d_moderate_r40"] == pytest.approx(0.5)


def test_a_label_matched_only_by_a_detection_below_the_minimum_height_is_ignored() -> None:
    """The label is 26 px high and looked for; a detection of 24.9 px is ignored, and so is its label: no hit, no miss,
    no false alarm. A higher one beside it is the match, whatever their scores.
    """
    label = replace(CAR, box_px=(100.0, 100.0, 150.0, 126.0))
    low = replace(label, box_px=(100.0, 100.0, 150.0, 124.9), score=0.9)
    high = replace(label, score=0.4)
    moderate = next(one for one in DIFFICULTIES if one.name == "moderate")

    def counted(*found: KittiLabel) -> tuple[list[float], list[float]]:
        chosen = choose(picture_boxes([label], found), "Car", moderate, "2d")
        counts = count(chosen, np.array([0.1]))
        return matched_scores(chosen), [float(part[0]) for part in (counts.tp, counts.fp, counts.fn)]

    assert counted(low) == ([], [0.0, 0.0, 0.0])
    assert counted(high) == ([0.4], [1.0, 0.0, 0.0])
    assert counted() == ([], [0.0, 0.0, 1.0])
    # The first pass takes the surest, which is too low; the second prefers the one that counts.
    assert counted(low, high) == ([], [1.0, 0.0, 0.0])
    good = [([CAR], [replace(CAR, score=1.0)])] * 60
    assert evaluate([*good, *[([label], [low])] * 60])["car_2d_moderate_r40"] == pytest.approx(0.5, abs=0.026)


def test_dont_care_excuses_in_the_picture_alone() -> None:
    good = [([CAR], [replace(CAR, score=1.0)])] * 60
    region = dont_care((90, 90, 210, 170))
    result = evaluate([*good, *[([region], [replace(CAR, score=1.0)])] * 60])
    assert result["car_2d_moderate_r40"] == 1.0
    assert result["car_3d_moderate_r40"] == pytest.approx(0.5)


def test_a_detection_needs_a_score() -> None:
    with pytest.raises(ValueError, match="score"):
        evaluate([([CAR], [CAR])])


@pytest.mark.parametrize("evaluator", [KittiEvaluator, NearCars])
def test_a_detection_of_a_type_that_is_none_is_refused(evaluator: Any) -> None:
    """It would find nothing, and its result file could not be read again."""
    with pytest.raises(ValueError, match=r"type must be one of Car, .*, got 'car'"):
        evaluator(lambda labels: labels).update([CAR], [replace(CAR, type="car", score=0.9)])


@pytest.mark.parametrize(
    "change",
    [
        {"score": math.nan},
        {"location_m": (0.0, 1.6, math.inf)},
        {"rotation_y_rad": math.nan},
        {"height_m": math.nan},
        {"box_px": (0.0, math.nan, 40.0, 60.0)},
        {"box_px": (40.0, 20.0, 0.0, 60.0)},
        {"box_px": (0.0, 60.0, 40.0, 20.0)},
    ],
)
def test_what_cannot_be_measured_is_refused_rather_than_taken_for_a_miss(change: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"finite|left, top, right, bottom"):
        evaluate([([CAR], [replace(CAR, **{"score": 0.9, **change})])])


def test_merged_pictures_count_as_if_one_had_seen_them_all() -> None:
    whole, first, second = (KittiEvaluator[list[KittiLabel]](lambda labels: labels) for _ in range(3))
    for seed in range(4):
        for evaluator in (whole, first if seed < 2 else second):
            evaluator.update(*picture(seed))
    first.merge(second)
    assert first.result() == pytest.approx(whole.result(), nan_ok=True)
    assert len(first.pictures) == 4


def test_every_metric_is_a_share() -> None:
    assert KittiEvaluator(lambda labels: labels).range_of("car_3d_moderate_r40") == (0.0, 1.0)


def test_each_draw_is_evaluated_separately_at_moderate_difficulty() -> None:
    """Picture 0 has no labels, so a draw of it alone is not known; picture 1 has a car that only `moderate` wants."""
    evaluator: KittiEvaluator[list[KittiLabel]] = KittiEvaluator(lambda labels: labels)
    evaluator.update([], [])
    evaluator.update([CAR, replace(CAR, occluded=1, box_px=(500, 100, 600, 160))], [replace(CAR, score=0.9)])
    spread = evaluator.resampled(np.array([[0] * 60, [1] * 60]))
    values = spread["car_2d_moderate_r40"]
    assert math.isnan(values[0]) and math.isnan(spread["ap_3d_moderate"][0])
    assert spread["ap_3d_moderate"][1] == spread["car_3d_moderate_r40"][1] > 0, "the mean of the one class there is"
    assert values[1] == pytest.approx(0.5), "half of the labels are found, at recalls up to 20 of 40"


def test_without_labels_nothing_is_known_and_nothing_has_a_ceiling() -> None:
    evaluator: KittiEvaluator[list[KittiLabel]] = KittiEvaluator(lambda labels: labels)
    evaluator.update([], [replace(CAR, score=0.9)])
    assert all(math.isnan(value) for value in evaluator.result().values())
    assert evaluator.ceilings() == {}
    curve = perfect_curve([])
    assert curve.shape == (41,) and np.isnan(curve).all()


@pytest.mark.parametrize("box", [(100, 100, 100, 160), (100, 160, 200, 160)])
def test_a_box_without_width_or_height_is_measured(box: tuple[float, float, float, float]) -> None:
    evaluator: KittiEvaluator[list[KittiLabel]] = KittiEvaluator(lambda labels: labels)
    assert evaluator.update([CAR], [replace(CAR, score=0.9, box_px=box)]) == {"found_share": 0, "false_alarms": 1}
