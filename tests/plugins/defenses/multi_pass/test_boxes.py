"""Pruning and merging of boxes, against worked values."""

from __future__ import annotations

import numpy as np
import pytest

from gear.formats.coco import Detection
from gear.plugins.defenses.multi_pass.boxes import merged, overlap_shares, pruned


def box(left: float, top: float, right: float, bottom: float, score: float = 0.9, category: int = 1) -> Detection:
    return Detection(category_id=category, box_px=(left, top, right, bottom), score=score)


def test_shares_are_of_the_first_boxes_area() -> None:
    shares = overlap_shares(np.array([[0.0, 0, 10, 10], [5, 5, 5, 9]]), np.array([[5.0, 0, 25, 10], [0, 0, 2, 2]]))
    assert shares.tolist() == [[0.5, 0.04], [0, 0]]


@pytest.mark.parametrize(("least", "kept"), [(0.6, 1), (0.5, 0)])
def test_a_box_that_a_base_box_covers_is_pruned_whatever_its_class(least: float, kept: int) -> None:
    masked, base = [box(0, 0, 10, 10, category=3)], [box(5, 0, 25, 10, category=1), box(100, 0, 110, 10)]
    assert len(pruned(masked, base, least)) == kept
    assert pruned(masked, [], least) == masked and pruned([], base, least) == []


def test_parts_of_an_object_are_merged_into_the_box_around_them() -> None:
    parts = [box(0, 0, 10, 10, 0.85, 3), box(50, 0, 60, 10, 0.9), box(0, 0, 4, 10, 0.95), box(3, 1, 11, 10, 0.82)]
    found = merged(parts)
    assert [one.box_px for one in found] == [(0, 0, 10, 10), (50, 0, 60, 10), (3, 1, 11, 10)]
    assert [(one.score, one.category_id) for one in found] == [(0.95, 3), (0.9, 1), (0.82, 1)]


def test_clusters_are_chains() -> None:
    """The first and the last box share nothing, and each covers nine tenths of its neighbour in the middle."""
    chain = [box(0, 0, 10, 10), box(1, 0, 29, 10), box(20, 0, 30, 10)]
    assert [one.box_px for one in merged(chain)] == [(0, 0, 30, 10)]
    assert merged([]) == []
