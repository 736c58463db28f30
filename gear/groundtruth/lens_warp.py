"""What a lens makes of silhouettes: the pinhole's, moved the way that pictures, depth and ids are moved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gear.camera.effects import PixelMap, recorded_effects
from gear.groundtruth.silhouettes import Mask, Window
from gear.values.geometry import Array
from gear.values.scene import CameraRecord


@dataclass(frozen=True, slots=True, eq=False)
class LensWarp:
    """How a camera's effects move pixels, for the silhouettes of the ground truth.

    Attributes:
        map: where each pixel of the picture comes from in the pinhole's picture, and the opposite way.
    """

    map: PixelMap

    @staticmethod
    def of(camera: CameraRecord) -> LensWarp | None:
        """The map that a camera's record holds; None for a pinhole.

        Raises:
            ValueError: the distortion folds the picture over.
        """
        moving = recorded_effects(camera)
        return LensWarp(moving[0].pixel_map(camera)) if moving else None

    def points(self, pinhole_px: Array) -> Array:
        """Where points of the pinhole's picture appear; also for points outside of the picture.

        Args:
            pinhole_px: (..., 2) index pixels.

        Returns:
            (..., 2) index pixels of the distorted picture.
        """
        return self.map.forward(pinhole_px)

    def window(self, window: Window) -> Window:
        """Where a window of the pinhole's picture appears in the distorted one, a pixel wider; empty if it is."""
        x0, y0, x1, y1 = window
        if x0 >= x1 or y0 >= y1:
            return window
        border = self.points(_border(window))
        size = self.map.x.shape[::-1]
        low = np.clip(np.floor(border.min(axis=0)) - 1, 0, size)
        high = np.clip(np.ceil(border.max(axis=0)) + 2, 0, size)
        return (int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    def mask(self, mask: Mask, window: Window, wanted: Window) -> Mask:
        """A silhouette as the distorted picture shows it, each pixel from the nearest one, as depth and ids are made.

        Args:
            mask: (h, w) of the pinhole.
            window: where that lies, inside the picture.
            wanted: what of the distorted picture is asked for, inside the picture.

        Returns:
            (rows, columns) of `wanted`.
        """
        (x0, y0, x1, y1), part = window, np.s_[wanted[1] : wanted[3], wanted[0] : wanted[2]]
        column, row = (np.rint(one[part]).astype(np.intp) for one in (self.map.x, self.map.y))
        held = (column >= x0) & (column < x1) & (row >= y0) & (row < y1)
        warped = np.zeros(held.shape, dtype=np.bool_)
        warped[held] = mask[row[held] - y0, column[held] - x0]
        return warped


def _border(window: Window) -> Array:
    """(N, 2) points around a window's pixels, half a pixel outside of their centres."""
    x0, y0, x1, y1 = window
    x, y = np.arange(x0, x1 + 1) - 0.5, np.arange(y0, y1 + 1) - 0.5
    sides = [(x, np.full_like(x, edge)) for edge in (y0 - 0.5, y1 - 0.5)]
    sides += [(np.full_like(y, edge), y) for edge in (x0 - 0.5, x1 - 0.5)]
    return np.concatenate([np.column_stack(side) for side in sides])
