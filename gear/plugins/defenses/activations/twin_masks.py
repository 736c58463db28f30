"""Finds the pixels of a patch by comparing two pictures that differ only in the patch."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.errors import GearError
from gear.values.frames import UInt8Image

LEAST_CHANGE = 12
"""A pixel counts as changed if one of its channels differs by at least this value (of 255). Light that a patch
reflects onto its surroundings changes pixels by less.
"""

CLOSING_PX = 5
"""Largest size in pixels of holes in the mask that are filled; holes arise where patch and background are alike."""

MOST_CHANGED = 0.5
"""If a larger share of the pixels has changed, the pictures are considered different scenes."""


def patch_area(clean: UInt8Image, patched: UInt8Image, number: int) -> npt.NDArray[np.bool_]:
    """The (H, W) bool mask of the pixels that show the patch, from pictures of one scene without and with the patch.

    Args:
        clean, patched: (H, W, 3) uint8 pictures without and with the patch.
        number: number of the sample, for the error message.

    Raises:
        GearError: the pictures differ in size or in more than half of their pixels, so they show different scenes.
    """
    if clean.shape == patched.shape:
        changed = (cv2.absdiff(clean, patched).max(axis=2) >= LEAST_CHANGE).astype(np.uint8)
        if changed.mean() <= MOST_CHANGED:
            kernel = np.ones((CLOSING_PX, CLOSING_PX), np.uint8)
            area: npt.NDArray[np.bool_] = cv2.morphologyEx(changed, cv2.MORPH_CLOSE, kernel) > 0
            return area
    raise GearError(
        f"sample {number} of the patched calibration is not the scene of sample {number} of the clean one: collect "
        "both with the same seed and settings, but for --patch"
    )
