from __future__ import annotations

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from gear.render.raster.pixel_mask import tile_corners

SIDE_PX = 4


def covered(corners: npt.NDArray[np.float64], shape: tuple[int, int]) -> npt.NDArray[np.int64]:
    """How many rectangles cover each pixel's centre."""
    height, width = shape
    x = (np.arange(width) + 0.5) * 2 / width - 1
    y = 1 - (np.arange(height) + 0.5) * 2 / height
    count = np.zeros(shape, np.int64)
    for rectangle in corners.reshape(-1, 6, 2):
        (left, bottom), (right, top) = rectangle.min(axis=0), rectangle.max(axis=0)
        count += np.outer((bottom < y) & (y < top), (left < x) & (x < right))
    return count


@given(arrays.arrays(np.bool_, arrays.array_shapes(min_dims=2, max_dims=2, max_side=19), elements=st.booleans()))
def test_the_tiles_with_chosen_pixels_are_covered_once_and_no_others(is_chosen: npt.NDArray[np.bool_]) -> None:
    expected = np.zeros(is_chosen.shape, np.int64)
    for row in range(0, is_chosen.shape[0], SIDE_PX):
        for column in range(0, is_chosen.shape[1], SIDE_PX):
            tile = np.s_[row : row + SIDE_PX, column : column + SIDE_PX]
            expected[tile] = is_chosen[tile].any()
    np.testing.assert_array_equal(covered(tile_corners(is_chosen, SIDE_PX), is_chosen.shape), expected)


def test_both_triangles_face_the_viewer_and_fill_the_rectangle() -> None:
    is_chosen = np.zeros((8, 16), np.bool_)
    is_chosen[5, 4:10] = True
    a, b, c = (tile_corners(is_chosen, SIDE_PX).reshape(2, 3, 2)[:, corner] for corner in range(3))
    (x1, y1), (x2, y2) = (b - a).T, (c - a).T
    areas = (x1 * y2 - y1 * x2) / 2
    assert (areas > 0).all()  # counter-clockwise
    assert areas.sum() == (8 * 2 / 16) * (4 * 2 / 8)  # neighbouring tiles are one rectangle


def test_a_picture_without_chosen_pixels_has_no_triangles() -> None:
    assert tile_corners(np.zeros((6, 6), np.bool_), SIDE_PX).shape == (0, 2)
