"""Where the patch is, from two pictures that differ in nothing but the patch."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.errors import GearError
from gear.values.frames import UInt8Image

LEAST_CHANGE = 12
"""Levels of a channel. What a patch does to the light on things near it is less."""

CLOSING_PX = 5
"""Holes where the patch happens to have the colour of what it covers are filled up to this size."""

MOST_CHANGED = 0.5
"""Share of a picture beyond which it is taken for another scene."""


def patch_area(clean: UInt8Image, patched: UInt8Image, number: int) -> npt.NDArray[np.bool_]:
    """(H, W): where the second picture shows the patch.

    Args:
        clean, patched: (H, W, 3) of one scene.
        number: of the sample, for the error.

    Raises:
        GearError: they are no twins.
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
