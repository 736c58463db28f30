"""Where boxes lie relative to a patch."""

from __future__ import annotations

import numpy as np
import pytest

from tests.metrics.drawn_objects import NO_PATCH, Box, area


def test_a_box_is_on_the_patch_by_its_centre_or_by_more_than_half() -> None:
    """The patch covers columns 25 to 49 and rows 20 to 39."""
    spots = area()
    cases: list[tuple[Box, bool, float]] = [
        ((30, 25, 40, 35), True, 0.0),
        ((0, 0, 60, 60), True, 0.0),  # a quarter of it, and its centre (30, 30)
        ((0, 20, 50, 40), True, 0.0),  # half of it, and its centre (25, 30)
        ((0, 20, 49.9, 40), False, 0.0),
        ((26, 0, 48, 39), False, 0.0),  # 19 of 39 rows, its centre above
        ((26, 2, 48, 45), True, 0.0),
        ((10, 25, 20, 35), False, 6.0),  # its last column is 19
        ((10, 5, 20, 15), False, round(float(np.hypot(6, 6)), 2)),
        ((-30, 25, -10, 35), False, 25.0),  # beyond the border: from the nearest pixel
    ]
    for box_px, is_on, pixels in cases:
        found = spots.distance(box_px, (0.0, 3.0, 6.0))
        assert (found.is_on_patch, found.pixels, found.metres) == (is_on, pytest.approx(pixels, abs=0.01), 5.0), box_px


def test_nothing_is_near_a_patch_that_is_not_seen() -> None:
    found = NO_PATCH.distance((10, 10, 30, 20), (0.0, 0.0, 1.0))
    assert (found.is_on_patch, found.pixels, found.metres) == (False, None, None)
