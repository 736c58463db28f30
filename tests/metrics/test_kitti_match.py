"""KITTI's rules for one picture: what counts, what is ignored, and who takes whom (`evaluate_object.cpp`)."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gear.formats.kitti_object import KittiLabel, dont_care
from gear.metrics.kitti_match import DIFFICULTIES, Chosen, Overlap, choose, count, matched_scores, picture_boxes

EASY, MODERATE, HARD = DIFFICULTIES
CAR = KittiLabel(
    type="Car",
    truncated=0.0,
    occluded=0,
    alpha_rad=0.5,
    box_px=(100, 100, 200, 160),
    height_m=1.5,
    width_m=1.8,
    length_m=4.2,
    location_m=(1.0, 1.65, 12.0),
    rotation_y_rad=0.4,
)


def found(score: float = 0.9, **changes: Any) -> KittiLabel:
    return replace(CAR, score=score, **changes)


def chosen(labels: list[KittiLabel], detections: list[KittiLabel], **options: Any) -> Chosen:
    picture = picture_boxes(labels, detections)
    difficulty, overlap = options.pop("difficulty", MODERATE), options.pop("overlap", "2d")
    return choose(picture, options.pop("kind", "Car"), difficulty, overlap, **options)


def counts(one: Chosen, threshold: float = 0.0) -> tuple[float, float, float]:
    """Hits, false alarms, misses."""
    at = count(one, np.array([threshold]))
    return float(at.tp[0]), float(at.fp[0]), float(at.fn[0])


@pytest.mark.parametrize(
    ("difficulty", "limits"), [(EASY, (40, 0, 0.15)), (MODERATE, (25, 1, 0.3)), (HARD, (25, 2, 0.5))]
)
def test_a_label_at_its_limits_is_looked_for_and_one_beyond_is_ignored(
    difficulty: Any, limits: tuple[float, int, float]
) -> None:
    """A label must be higher than the least height; occlusion and truncation may reach their limits."""
    height, occluded, truncated = limits
    box = (100.0, 100.0, 200.0, 100.0 + height)
    labels = [
        replace(CAR, occluded=occluded, truncated=truncated),
        replace(CAR, occluded=occluded + 1),
        replace(CAR, truncated=truncated + 0.01),
        replace(CAR, box_px=box),
        replace(CAR, box_px=(*box[:3], box[3] + 0.1)),
    ]
    assert chosen(labels, [], difficulty=difficulty).label_state.tolist() == [0, 1, 1, 1, 0]


@pytest.mark.parametrize(
    ("kind", "states"),
    [
        ("Car", {"Car": 0, "Van": 1}),
        ("Pedestrian", {"Pedestrian": 0, "Person_sitting": 1}),
        ("Cyclist", {"Cyclist": 0}),
    ],
)
def test_types_that_resemble_a_class_are_ignored_and_others_are_of_no_concern(
    kind: str, states: dict[str, int]
) -> None:
    types = ["Car", "Van", "Truck", "Pedestrian", "Person_sitting", "Cyclist", "Tram", "Misc"]
    labels = [replace(CAR, type=name, occluded=0) for name in types]
    assert chosen(labels, [], kind=kind).label_state.tolist() == [states.get(name, -1) for name in types]


def test_the_height_of_a_detection_is_cut_to_whole_pixels_before_its_type_counts() -> None:
    def high(height: float, **changes: Any) -> KittiLabel:
        return found(box_px=(0.0, 0.0, 50.0, height), **changes)

    detections = [high(24.99), high(25.0), high(25.9), high(24.99, type="Truck"), high(25.0, type="Truck")]
    assert chosen([], detections).detection_state.tolist() == [1, 0, 0, 1, -1]
    assert chosen([], [high(39.9), high(40.0)], difficulty=EASY).detection_state.tolist() == [1, 0]


def test_what_is_farther_than_a_limit_is_ignored() -> None:
    at, beyond = (replace(CAR, location_m=(0.0, 1.65, z)) for z in (40.0, 40.1))
    one = chosen([at, beyond], [replace(at, score=0.5), replace(beyond, score=0.5)], max_distance_m=40.0)
    assert (one.label_state.tolist(), one.detection_state.tolist()) == ([0, 1], [0, 1])


@pytest.mark.parametrize(
    ("right", "expected"),
    [(170.0, (0.0, 1.0, 1.0)), (170.1, (1.0, 0.0, 0.0))],  # 0.7 of the label's 100 px; more than that is a match
)
def test_a_match_needs_more_than_the_least_overlap(right: float, expected: tuple[float, float, float]) -> None:
    assert counts(chosen([CAR], [found(box_px=(100, 100, right, 160))])) == expected


def test_a_least_overlap_of_its_own_takes_the_place_of_the_benchmarks() -> None:
    half = found(box_px=(100, 100, 160, 160))
    assert counts(chosen([CAR], [half], min_overlap=0.5)) == (1, 0, 0)
    assert counts(chosen([CAR], [half], min_overlap=0.6)) == (0, 1, 1)


@pytest.mark.parametrize(("overlap", "excuses"), [("2d", True), ("bev", False), ("3d", False)])
@pytest.mark.parametrize(("right", "is_inside"), [(170.0, False), (170.1, True)])
def test_a_detection_that_overlaps_an_ignored_region_enough_is_no_false_alarm(
    overlap: Overlap, excuses: bool, right: float, is_inside: bool
) -> None:
    """Of the detection's own area; two regions that share it do not add up."""
    parts = [dont_care((0, 0, 150, 300)), dont_care((150, 0, 300, 300))]
    assert counts(chosen(parts, [found()], overlap=overlap)) == (0, 1, 0)
    one = chosen([dont_care((0, 0, right, 300)), dont_care((900, 0, 901, 1))], [found()], overlap=overlap)
    assert counts(one) == (0, 0 if excuses and is_inside else 1, 0)


def test_orientation_gains_are_half_of_one_and_the_cosine() -> None:
    turns = [0.0, 1.0, math.pi / 2, math.pi]
    labels, detections = [replace(CAR, alpha_rad=-0.3)] * 2, [found(alpha_rad=-0.3 + turn) for turn in turns]
    gains = chosen(labels, detections).angle_gain
    np.testing.assert_allclose(gains, [[(1 + math.cos(turn)) / 2 for turn in turns]] * 2, atol=1e-12)
    at = count(chosen(labels[:1], detections[1:2]), np.array([0.5]))
    assert at.similarity.tolist() == pytest.approx([(1 + math.cos(1.0)) / 2])


def test_above_a_threshold_the_largest_overlap_is_taken_and_below_all_the_surest() -> None:
    """The other detection of a label that is taken is a false alarm."""
    close, sure = found(0.6, box_px=(100, 100, 199, 160)), found(0.8, box_px=(100, 100, 180, 160))
    one = chosen([CAR, replace(CAR, box_px=(500, 100, 600, 160))], [sure, close])
    assert matched_scores(one) == [0.8]
    at = count(one, np.array([0.8, 0.7, 0.6, 0.5]))
    assert (at.tp.tolist(), at.fp.tolist(), at.fn.tolist()) == ([1.0] * 4, [0, 0, 1, 1], [1.0] * 4)
    turned = chosen([CAR], [replace(sure, alpha_rad=CAR.alpha_rad + math.pi), close])
    assert count(turned, np.array([0.7, 0.6])).similarity.tolist() == pytest.approx([0.0, 1.0])


def test_each_label_takes_one_detection_in_the_order_of_the_file() -> None:
    one = chosen([CAR, CAR], [found(0.9), found(0.7)])
    assert matched_scores(one) == [0.9, 0.7] and counts(one) == (2, 0, 0)
    assert counts(chosen([CAR, CAR], [found(0.9)])) == (1, 0, 1)


def test_an_ignored_label_takes_its_detection_and_neither_counts() -> None:
    hidden = replace(CAR, occluded=3)
    one = chosen([hidden], [found()])
    assert matched_scores(one) == [] and counts(one) == (0, 0, 0)
    assert counts(chosen([replace(CAR, type="Truck")], [found()])) == (0, 1, 0)


def test_the_first_low_detection_is_taken_where_no_proper_one_is() -> None:
    """Whatever their overlaps: the second, which fits better, is left for the next label."""
    label = replace(CAR, box_px=(100.0, 100.0, 150.0, 126.0))
    low = [found(box_px=(100.0, 100.0, 150.0, bottom)) for bottom in (123.0, 124.9)]
    assert counts(chosen([label], low)) == (0, 0, 0) and matched_scores(chosen([label], low)) == []
    assert counts(chosen([label, label], low)) == (0, 0, 0)
    assert counts(chosen([label, label, label], low)) == (0, 0, 1)


def test_a_picture_without_detections_or_labels_counts_as_it_is() -> None:
    assert counts(chosen([CAR], [])) == (0, 0, 1) and matched_scores(chosen([CAR], [])) == []
    assert counts(chosen([], [found()])) == (0, 1, 0)
    assert counts(chosen([], [])) == (0, 0, 0)
