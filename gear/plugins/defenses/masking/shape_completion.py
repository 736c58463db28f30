"""Completes the mask of a patch to a rectangle (Liu et al., Segment and Complete, CVPR 2022, section 3.3)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

Bool = npt.NDArray[np.bool_]

FIRST, DECAY, TRIES = 0.9, 0.7, 15
"""First similarity that is demanded of a rectangle, its factor at each further try, and the number of tries."""


def completed(mask: Bool, sizes: Sequence[tuple[int, int]]) -> Bool:
    """Returns the union of all rectangles of given sizes that are close to the mask, (H, W) bool.

    A rectangle of area a is close if the mask differs from it in fewer than (1 - s) a pixels (L1 distance). The
    similarity s starts at 0.9, and is lowered by the factor 0.7 until at least one rectangle is close. After 15 tries
    the mask is empty. The authors' patches are square, with known side lengths.

    Args:
        mask: (H, W) bool.
        sizes: heights and widths of the rectangles, pixels; those that exceed the picture are left out.
    """
    distances = [
        (size, _distances(mask, size)) for size in sizes if size[0] <= mask.shape[0] and size[1] <= mask.shape[1]
    ]
    similarity = FIRST
    for _ in range(TRIES):
        result = np.zeros_like(mask)
        for size, values in distances:
            result |= _union(values < (1 - similarity) * size[0] * size[1], size)
        if result.any():
            return result
        similarity *= DECAY
    return np.zeros_like(mask)


def _distances(mask: Bool, size: tuple[int, int]) -> npt.NDArray[np.float64]:
    """The number of pixels in which the mask differs from a rectangle, for each place of its upper left corner."""
    height, width = size
    sums = cv2.integral(mask.astype(np.uint8), sdepth=cv2.CV_64F)
    inside = sums[height:, width:] - sums[:-height, width:] - sums[height:, :-width] + sums[:-height, :-width]
    return np.asarray(height * width - inside + (mask.sum() - inside), np.float64)


def _union(corners: Bool, size: tuple[int, int]) -> Bool:
    """The union of the rectangles of one size with given upper left corners, (H, W) bool.

    Sums of the corners, +1 where a rectangle begins and -1 behind its end, count the rectangles over each pixel.
    """
    (height, width), (rows, columns) = size, corners.shape
    steps = np.zeros((rows + height, columns + width), np.int64)
    for top, left, sign in ((0, 0, 1), (height, 0, -1), (0, width, -1), (height, width, 1)):
        steps[top : top + rows, left : left + columns] += sign * corners.astype(np.int64)
    return np.asarray(steps.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0, np.bool_)
