"""Curves of average precision against hand-made matches, whose values have a closed form."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gear.metrics.coco_curves import Matches, average_precision, known_mean, matches, resampled


def gathered(owner: list[int], hit: list[list[int]], counts: list[list[int]], wanted: list[int]) -> Matches:
    return Matches(
        owner=np.array(owner, np.int64),
        hit=np.array(hit, np.bool_),
        counts=np.array(counts, np.bool_),
        label_counts=np.array(wanted, np.int64),
    )


TWO = gathered([0, 1, 1], [[1, 0, 1]], [[1, 1, 1]], [1, 1])
"""A hit in picture 0, then a false alarm and a hit in picture 1; one label in each."""


@pytest.mark.parametrize(
    ("weights", "expected"),
    [
        # Recall 1/2 at precision 1, recall 1 at 2/3: 51 of the 101 recalls are at most 1/2.
        ([1, 1], (51 * 1 + 50 * 2 / 3) / 101),
        # Picture 0 twice: two hits, the alarm, a hit. Recall 2/3 at 1, recall 1 at 3/4; 67 recalls are at most 2/3.
        ([2, 1], (67 * 1 + 34 * 3 / 4) / 101),
        # Picture 1 alone: the alarm, the hit.
        ([0, 1], 1 / 2),
        ([3, 0], 1.0),
    ],
)
def test_average_precision_is_the_mean_over_101_recalls(weights: list[int], expected: float) -> None:
    assert average_precision(TWO, np.array(weights)) == pytest.approx([expected], abs=1e-12)


def test_recalls_that_are_never_reached_have_no_precision() -> None:
    """One of four labels is found: recalls 0, 0.01, ..., 0.25 are reached."""
    one = gathered([0], [[1]], [[1]], [4])
    assert average_precision(one, np.array([1])) == pytest.approx([26 / 101], abs=1e-12)


def test_ignored_detections_count_neither_way_and_each_overlap_has_its_own_value() -> None:
    """The first detection is ignored at the second overlap, a false alarm at the third, and a hit at the first."""
    found = gathered([0, 0], [[1, 0], [0, 1], [0, 1]], [[1, 1], [0, 1], [1, 1]], [1])
    assert average_precision(found, np.array([1])) == pytest.approx([1.0, 1.0, 0.5], abs=1e-12)


def test_without_labels_among_the_drawn_pictures_nothing_is_known() -> None:
    found = gathered([0], [[1], [0]], [[1], [1]], [1, 0])
    assert np.isnan(average_precision(found, np.array([0, 2]))).tolist() == [True, True]


def test_each_draw_counts_a_picture_as_often_as_it_was_drawn() -> None:
    other = gathered([1], [[1]], [[1]], [0, 1])
    values = resampled([TWO, other], np.array([[0, 1], [1, 1], [0, 0]]))
    assert values.shape == (3, 2, 1)
    np.testing.assert_allclose(values[:, 0, 0], [(51 + 50 * 2 / 3) / 101, 0.5, 1.0], atol=1e-12)
    np.testing.assert_allclose(values[:, 1, 0], [1.0, 1.0, np.nan], atol=1e-12)
    assert resampled([], np.array([[0, 1]])).shape == (1, 0, 1)


def test_a_mean_leaves_out_what_is_not_known() -> None:
    values = np.array([[1.0, np.nan, 4.0], [np.nan, np.nan, np.nan]])
    np.testing.assert_array_equal(known_mean(values, (1,)), [2.5, np.nan])
    np.testing.assert_array_equal(known_mean(values, (0,)), [1.0, np.nan, 4.0])
    np.testing.assert_array_equal(known_mean(values, (0, 1)), 2.5)


def row(scores: list[float], matched: list[list[int]], ignored: list[list[int]], labels: list[int]) -> dict[str, Any]:
    """What `COCOeval` keeps of one picture, category and range of areas."""
    return {
        "dtScores": scores,
        "dtMatches": np.array(matched, float),
        "dtIgnore": np.array(ignored, float),
        "gtIgnore": np.array(labels),
    }


def test_matches_are_read_by_category_from_the_first_range_of_areas() -> None:
    """Two pictures, two ranges of areas, two categories, as `COCOeval` orders them; at most two detections each."""
    first = row([0.9, 0.5, 0.4], [[7, 0, 8], [0, 0, 9]], [[0, 1, 0], [0, 1, 0]], [0, 1])
    second = row([0.7], [[3], [0]], [[0], [0]], [0, 0])
    unlabelled = row([0.8], [[0], [0]], [[0], [0]], [1])
    never = row([1.0], [[1], [1]], [[0], [0]], [0])
    evaluation = SimpleNamespace(
        params=SimpleNamespace(imgIds=[4, 5], areaRng=[0, 1], catIds=[3, 6, 8], maxDets=[1, 2], iouThrs=[0.5, 0.75]),
        evalImgs=[first, second, never, never, unlabelled, None, never, never, None, second, never, never],
    )
    found = matches(evaluation)
    assert list(found) == [3, 8], "a category without a label to be found is left out"
    car, truck = found[3], found[8]
    assert car.owner.tolist() == [0, 1, 0], "surest first: 0.9, 0.7, 0.5; the third of a picture is over the limit"
    assert car.hit.tolist() == [[True, True, False], [False, False, False]]
    assert car.counts.tolist() == [[True, True, False], [True, True, False]]
    assert car.label_counts.tolist() == [1, 2]
    assert truck.owner.tolist() == [1] and truck.label_counts.tolist() == [0, 2]


def test_equal_scores_keep_the_order_of_the_pictures() -> None:
    """As in pycocotools, whose sort is stable: of 400 detections, 200 have one score and 200 another."""
    count = 400
    rows = [row([0.9 if number % 2 else 0.5], [[number % 7 == 0]], [[0]], [0]) for number in range(count)]
    evaluation = SimpleNamespace(
        params=SimpleNamespace(imgIds=list(range(count)), areaRng=[0], catIds=[3], maxDets=[100], iouThrs=[0.5]),
        evalImgs=rows,
    )
    found = matches(evaluation)[3]
    order = [*range(1, count, 2), *range(0, count, 2)]
    assert found.owner.tolist() == order
    assert found.hit[0].tolist() == [number % 7 == 0 for number in order]
