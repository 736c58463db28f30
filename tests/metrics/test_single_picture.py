"""What was found and what was made up in one picture, box by box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from gear.metrics.single_picture import boxes, single_metrics

Row = tuple[tuple[float, float, float, float], int, float]
LABEL: Row = ((0, 0, 20, 10), 0, 1.0)


def metrics(
    labels: Sequence[Row], found: Sequence[Row], ignored: Sequence[Sequence[float]] = ()
) -> tuple[float, float]:
    result = single_metrics(boxes(labels), boxes(found), np.array(ignored, dtype=np.float64).reshape(-1, 4))
    return result["found_share"], result["false_alarms"]


@pytest.mark.parametrize(("right", "expected"), [(10.0, (1, 0)), (9.9, (0, 1))])
def test_half_an_overlap_is_enough(right: float, expected: tuple[float, float]) -> None:
    assert metrics([LABEL], [((0, 0, right, 10), 0, 0.9)]) == expected


@pytest.mark.parametrize(("score", "expected"), [(0.5, (1, 0)), (0.49, (0, 0))])
def test_a_detection_counts_from_a_half_on(score: float, expected: tuple[float, float]) -> None:
    assert metrics([LABEL], [((0, 0, 20, 10), 0, score)]) == expected


@pytest.mark.parametrize("is_last", [False, True])
def test_the_surest_chooses_first_whatever_the_order(is_last: bool) -> None:
    """It takes the label that the other one lies on; by the other's choice there would be one for each."""
    labels: list[Row] = [LABEL, ((6, 0, 26, 10), 0, 1.0)]
    found: list[Row] = [((2, 0, 22, 10), 0, 0.9), ((-4, 0, 16, 10), 0, 0.8)]
    assert metrics(labels, found[::-1] if is_last else found) == (0.5, 1)


@pytest.mark.parametrize(("ignored_from", "alarms"), [(60.0, 0), (60.1, 1)])
def test_half_of_it_in_an_ignored_box_excuses_a_detection(ignored_from: float, alarms: int) -> None:
    assert metrics([LABEL], [((50, 0, 70, 10), 0, 0.9)], [(ignored_from, -50, 500, 50)]) == (0, alarms)


def test_what_lies_in_an_ignored_box_may_still_find_its_label() -> None:
    assert metrics([LABEL], [((0, 0, 20, 10), 0, 0.9)], [(-50, -50, 500, 50)]) == (1, 0)
