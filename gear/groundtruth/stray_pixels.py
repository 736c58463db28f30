"""Removes stray pixels: small visible pieces of an object, far from its larger pieces."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

Mask = npt.NDArray[np.bool_]

STRAY_SHARE = 0.05
"""Largest share of an object's visible pixels that a stray piece may have."""

MAIN_SHARE = 0.5
"""Smallest share of an object's visible pixels that the larger pieces must have together. Below it the object is
scattered, and all of its pieces are kept.
"""


def without_strays(mask: Mask) -> tuple[Mask, int, int]:
    """Removes stray pieces from the mask of an object's visible pixels, because they would enlarge its box.

    A piece is 8-connected. It is removed if it has at most 5 % of the pixels (`STRAY_SHARE`) and extends beyond the box
    of the larger pieces. Examples are a handlebar beyond the rider in front of it, or three pixels of a person between
    the leaves of a hedge.

    Args:
        mask: (h, w) bool visible pixels, cropped to their tight box.

    Returns:
        The mask of the kept pixels, cropped to their tight box, and the column and row of its first pixel in the input
        mask.
    """
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    if count <= 2:
        return mask, 0, 0
    areas = stats[1:, cv2.CC_STAT_AREA]
    left, top = stats[1:, cv2.CC_STAT_LEFT], stats[1:, cv2.CC_STAT_TOP]
    right, bottom = left + stats[1:, cv2.CC_STAT_WIDTH], top + stats[1:, cv2.CC_STAT_HEIGHT]
    is_main = areas > STRAY_SHARE * areas.sum()
    if areas[is_main].sum() < MAIN_SHARE * areas.sum():
        return mask, 0, 0
    x0, y0, x1, y1 = left[is_main].min(), top[is_main].min(), right[is_main].max(), bottom[is_main].max()
    is_kept = (left >= x0) & (top >= y0) & (right <= x1) & (bottom <= y1)
    kept = np.concatenate([[False], is_kept])[pieces[y0:y1, x0:x1]]
    return np.ascontiguousarray(kept), int(x0), int(y0)
