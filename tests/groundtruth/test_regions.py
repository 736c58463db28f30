"""Boxes around parts of a mask, and the least share of an object inside one."""

from __future__ import annotations

import numpy as np
import pytest

from gear.groundtruth.regions import least_share_inside, part_boxes


def test_each_connected_part_has_its_tight_box() -> None:
    mask = np.zeros((20, 30), np.bool_)
    assert part_boxes(mask) == ()
    mask[2:5, 3:9] = mask[5, 9] = True  # a corner joins two pixels
    mask[10:20, 25:30] = True
    assert part_boxes(mask) == ((3.0, 2.0, 10.0, 6.0), (25.0, 10.0, 30.0, 20.0))
    assert part_boxes(np.ones((20, 30), np.bool_)) == ((0.0, 0.0, 30.0, 20.0),)


@pytest.mark.parametrize(("visible_px", "expected"), [(100, 0.4), (60, 0.0), (61, 1 / 61), (30, 0.0), (0, 0.0)])
def test_what_may_lie_outside_the_mask_is_assumed_to(visible_px: int, expected: float) -> None:
    """Of a box of 100 pixels 40 are masked: the other 60 may be the object's."""
    mask = np.zeros((20, 30), np.bool_)
    mask[:, :9] = True
    assert least_share_inside((5.0, 5.0, 15.0, 15.0), visible_px, mask) == pytest.approx(expected)


def test_a_box_without_a_masked_pixel_has_no_share() -> None:
    assert least_share_inside((5.0, 5.0, 15.0, 15.0), 500, np.zeros((20, 30), np.bool_)) == 0
