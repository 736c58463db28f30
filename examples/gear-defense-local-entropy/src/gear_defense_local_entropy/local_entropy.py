"""Local entropy at three scales against a threshold that rises with the picture's own entropy; then inpainting.

The paper completes the mask with an autoencoder trained on patch shapes; here it is closed by morphology, so that
nothing has to be trained.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt
from gear.plugins.defenses.per_picture import Mask, PerPicture
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

    from gear_defense_local_entropy import LocalEntropyConfig

Bool = npt.NDArray[np.bool_]


class LocalEntropy(PerPicture):
    """Detects areas of high local entropy and fills them in."""

    def __init__(self, config: LocalEntropyConfig) -> None:
        self.config = config

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """The picture with the detected areas inpainted, and (H, W) float32 mask of them."""
        mask = self.suspicious(picture)
        if not mask.any():
            return picture.copy(), mask.astype(np.float32)
        filled = cv2.inpaint(np.ascontiguousarray(picture), mask.astype(np.uint8), 3, cv2.INPAINT_TELEA)
        return np.asarray(filled, np.uint8), mask.astype(np.float32)

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Raises an error: no gradient passes the search for windows."""
        raise ValueError("local_entropy has no gradient; attack it by queries")

    def suspicious(self, picture: UInt8Image) -> Bool:
        """(H, W) bool, True where a patch is detected."""
        config = self.config
        grey = np.asarray(cv2.cvtColor(np.ascontiguousarray(picture), cv2.COLOR_RGB2GRAY), np.uint8)
        mask = np.zeros(grey.shape, np.bool_)
        constants = zip(config.patch_mean, config.patch_std, config.clean_mean, config.clean_std, strict=True)
        for side, (patch_mean, patch_std, clean_mean, clean_std) in zip(sides(grey.shape), constants, strict=True):
            windows = list(entropies(grey, side))
            mean = float(np.mean([bits for _, _, bits in windows]))
            threshold = patch_mean + 1.5 * patch_std - 2 * (patch_mean - clean_mean) / patch_mean * patch_std
            threshold += (mean - clean_mean) / clean_std * patch_std
            for top, left, bits in windows:
                if bits > threshold:
                    mask[top : top + side, left : left + side] = True
        return self._completed(mask)

    def _completed(self, mask: Bool) -> Bool:
        """The mask without small blobs, closed and dilated."""
        count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
        areas = stats[:, cv2.CC_STAT_AREA]
        large = [i for i in range(1, count) if areas[i] >= self.config.least_share * mask.size]
        kept = np.isin(labels, large) if large else mask
        size = 2 * self.config.grow_px + 1
        kernel = np.ones((size, size), np.uint8)
        closed = cv2.morphologyEx(kept.astype(np.uint8), cv2.MORPH_CLOSE, kernel)
        return np.asarray(cv2.dilate(closed, kernel)) > 0


def sides(shape: tuple[int, ...]) -> tuple[int, int, int]:
    """Window sizes in pixels: a hundredth of the picture, but at least 8 and even; half as much again; twice."""
    first = max(8, 2 * math.ceil(max(shape) / 200))
    return first, 2 * math.ceil(0.75 * first), 2 * first


def entropies(grey: npt.NDArray[np.uint8], side: int) -> Iterator[tuple[int, int, float]]:
    """Top, left and entropy in bits of each window; windows overlap by half and reach the last row and column."""
    height, width = grey.shape
    side_y, side_x = min(side, height), min(side, width)
    tops = sorted({*range(0, height - side_y + 1, side // 2), height - side_y})
    lefts = sorted({*range(0, width - side_x + 1, side // 2), width - side_x})
    windows = np.lib.stride_tricks.sliding_window_view(grey, (side_y, side_x))
    for top in tops:
        row = windows[top, lefts].reshape(len(lefts), -1)
        values = row.astype(np.int64) + 256 * np.arange(len(lefts))[:, None]
        counts = np.bincount(values.reshape(-1), minlength=256 * len(lefts)).reshape(len(lefts), 256)
        shares = counts / row.shape[1]
        bits = -(shares * np.log2(np.where(shares > 0, shares, 1))).sum(axis=1)
        for left, value in zip(lefts, bits.tolist(), strict=True):
            yield top, left, value
