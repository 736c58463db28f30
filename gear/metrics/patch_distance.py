"""Measures the distances of boxes from the visible pixels of the patches in a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.ground_truth import BoxPx
from gear.values.picture_objects import PatchDistance
from gear.values.scene import Vec3

MOSTLY = 0.5
"""Share of a box's pixels on a patch above which the box as a whole lies on the patch."""


class PatchArea:
    """The visible pixels and the positions of the patches in one picture, from which distances are measured."""

    def __init__(self, mask: npt.NDArray[np.bool_], middles_m: Sequence[Vec3] = ()) -> None:
        """Stores the visible patches of one picture.

        Args:
            mask: (H, W) bool, the visible pixels of all patches.
            middles_m: middle of each visible patch in the camera's frame, metres.
        """
        self._mask, self._middles_m = mask, middles_m
        self._distance_px: npt.NDArray[np.float32] | None = None
        if mask.any():
            away = (~mask).astype(np.uint8)
            self._distance_px = np.asarray(cv2.distanceTransform(away, cv2.DIST_L2, cv2.DIST_MASK_PRECISE))

    def distance(self, box_px: BoxPx, position_m: Vec3 | None = None) -> PatchDistance:
        """Measures the distance of a box from the visible patches, in pixels and, if `position_m` is known, in
        metres.

        Args:
            box_px: box in edge pixels, which may extend beyond the picture. Its pixels are the pixels of the picture
                with their centre inside the box, or the nearest pixel if there are none.
            position_m: middle of the object in the camera's frame, if it is known.

        Returns:
            The distance; both of its numbers are None if no patch is visible.
        """
        if self._distance_px is None:
            return PatchDistance(is_on_patch=False, pixels=None)
        height, width = self._mask.shape
        left, top, right, bottom = box_px
        columns, rows = _pixels(left, right, width), _pixels(top, bottom, height)
        share = float(self._mask[rows, columns].mean())
        row, column = math.floor((top + bottom) / 2), math.floor((left + right) / 2)
        is_centre_on = 0 <= row < height and 0 <= column < width and bool(self._mask[row, column])
        metres = None
        if position_m is not None and self._middles_m:
            metres = round(min(math.dist(position_m, middle_m) for middle_m in self._middles_m), 3)
        return PatchDistance(
            is_on_patch=is_centre_on or share > MOSTLY,
            pixels=round(float(self._distance_px[rows, columns].min()), 2),
            metres=metres,
        )


def _pixels(low: float, high: float, size: int) -> slice:
    """The pixels of a side of a picture with a centre between two edges; the nearest pixel where there is none."""
    first, end = max(0, math.ceil(low - 0.5)), min(size, math.ceil(high - 0.5))
    if first < end:
        return slice(first, end)
    nearest = min(max(0, math.floor((low + high) / 2)), size - 1)
    return slice(nearest, nearest + 1)
