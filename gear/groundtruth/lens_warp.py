"""Moves silhouettes of the pinhole camera in the same way as a lens moves pictures, depth and ids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gear.camera.effects import PixelMap, recorded_effects
from gear.groundtruth.silhouettes import Mask, Window
from gear.values.geometry import Array
from gear.values.scene import CameraRecord


@dataclass(frozen=True, slots=True, eq=False)
class LensWarp:
    """The map by which a camera's lens moves pixels, for use on silhouettes.

    Attributes:
        map: position in the pinhole's picture for each pixel of the distorted picture, and the inverse map.
    """

    map: PixelMap

    @staticmethod
    def of(camera: CameraRecord) -> LensWarp | None:
        """The warp of a camera's lens; None for a camera without a lens.

        Args:
            camera: the camera with its lens.

        Raises:
            ValueError: the distortion folds the picture over.
        """
        moving = recorded_effects(camera)
        return LensWarp(moving[0].pixel_map(camera)) if moving else None

    def points(self, pinhole_px: Array) -> Array:
        """Converts positions in the pinhole's picture to positions in the distorted picture, also outside the
        picture.

        Args:
            pinhole_px: (..., 2) index pixels.

        Returns:
            (..., 2) index pixels of the distorted picture.
        """
        return self.map.forward(pinhole_px)

    def window(self, window: Window) -> Window:
        """The window of the distorted picture that contains `window`, a window of the pinhole's picture, with a
        margin of one pixel. An empty window stays empty.

        Args:
            window: first column, first row, one past the last column, and one past the last row.
        """
        x0, y0, x1, y1 = window
        if x0 >= x1 or y0 >= y1:
            return window
        border = self.points(_border(window))
        size = self.map.x.shape[::-1]
        low = np.clip(np.floor(border.min(axis=0)) - 1, 0, size)
        high = np.clip(np.ceil(border.max(axis=0)) + 2, 0, size)
        return (int(low[0]), int(low[1]), int(high[0]), int(high[1]))

    def mask(self, mask: Mask, window: Window, wanted: Window) -> Mask:
        """Warps a silhouette from the pinhole's to the distorted picture by nearest neighbour, in the same way as
        depth and ids.

        A window is (first column, first row, one past the last column, one past the last row).

        Args:
            mask: (h, w) bool silhouette of the pinhole camera.
            window: position of the mask in the pinhole's picture, inside this picture.
            wanted: window of the distorted picture for which the result is computed, inside this picture.

        Returns:
            (rows, columns) bool mask of the window `wanted`.
        """
        (x0, y0, x1, y1), part = window, np.s_[wanted[1] : wanted[3], wanted[0] : wanted[2]]
        column, row = (np.rint(one[part]).astype(np.intp) for one in (self.map.x, self.map.y))
        held = (column >= x0) & (column < x1) & (row >= y0) & (row < y1)
        warped = np.zeros(held.shape, dtype=np.bool_)
        warped[held] = mask[row[held] - y0, column[held] - x0]
        return warped


def _border(window: Window) -> Array:
    """(N, 2) points on the border of a window, half a pixel outside the centres of its outermost pixels."""
    x0, y0, x1, y1 = window
    x, y = np.arange(x0, x1 + 1) - 0.5, np.arange(y0, y1 + 1) - 0.5
    sides = [(x, np.full_like(x, edge)) for edge in (y0 - 0.5, y1 - 0.5)]
    sides += [(np.full_like(y, edge), y) for edge in (x0 - 0.5, x1 - 0.5)]
    return np.concatenate([np.column_stack(side) for side in sides])
