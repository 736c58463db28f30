"""Local entropy of pictures: Shannon entropy of the grey levels in overlapping windows (Tarchoun et al., CVPR 2023)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

GREY = (0.299, 0.587, 0.114)
"""Weights of red, green and blue in a grey level (ITU-R BT.601), as in MATLAB's `rgb2gray`."""

LEVELS = 256

SOFT_LEVELS, SMOOTHING = 16, (1, 2, 3, 2, 1)
"""Levels of the soft histogram, and weights with which neighbouring levels are mixed. The wider a pixel is spread, the
farther its gradient reaches: on noise, following the gradient for 60 steps lowers the exact entropy from 5.7 to 3.7
bits; with 32 levels that are not mixed, to 5.3 bits.
"""


def window_sides(height: int, width: int) -> tuple[int, int, int]:
    """Returns the sides in pixels of the three window sizes: a hundredth of the picture, at least 8; 1.5 times; twice.

    All are even (Tarchoun et al., jedi.m).

    Args:
        height, width: size of the picture in pixels.
    """
    first = max(8, *(2 * math.ceil(math.ceil(size / 100) / 2) for size in (height, width)))
    return first, 2 * math.ceil(0.75 * first), 2 * first


def grey_levels(picture: UInt8Image) -> npt.NDArray[np.uint8]:
    """Returns the (H, W) uint8 grey levels of a picture.

    Args:
        picture: (H, W, 3) uint8 sRGB.
    """
    return np.asarray(cv2.cvtColor(np.ascontiguousarray(picture), cv2.COLOR_RGB2GRAY), np.uint8)


def grey_tensor(pictures: Tensor) -> Tensor:
    """Returns the (B, H, W) grey values of pictures in 0..1; differentiable.

    Args:
        pictures: (B, 3, H, W) in 0..1.
    """
    return (pictures * pictures.new_tensor(GREY).view(1, 3, 1, 1)).sum(1)


def window_entropies(grey: npt.NDArray[np.uint8], side: int) -> npt.NDArray[np.float32]:
    """Returns the entropies in bits of square windows at half a side's distance, (rows, columns) float32.

    The picture is first extended by half a side at each border, mirrored with the border's pixels. The window (i, j)
    is centred at the pixel (i, j) * side / 2 and has side + 1 pixels in each direction, since MATLAB's ranges include
    both ends; the authors' constants hold for such windows (jedi.m).

    Args:
        grey: (H, W) uint8 grey levels.
        side: even side of the windows, pixels.
    """
    half, pixels = side // 2, side + 1
    extended = np.pad(grey, half, mode="symmetric").astype(np.int64)
    windows = np.lib.stride_tricks.sliding_window_view(extended, (pixels, pixels))[::half, ::half]
    number = np.arange(pixels * pixels + 1)
    terms = (number * np.log2(np.maximum(number, 1))).astype(np.float32)
    rows, columns = windows.shape[:2]
    start = LEVELS * np.arange(columns)[:, None]
    entropies = np.empty((rows, columns), np.float32)
    for i in range(rows):
        values = windows[i].reshape(columns, -1) + start
        counts = np.bincount(values.reshape(-1), minlength=LEVELS * columns).reshape(columns, LEVELS)
        entropies[i] = np.log2(pixels * pixels) - terms[counts].sum(axis=1) / np.float32(pixels * pixels)
    return entropies


def window_of_pixels(size_px: int, side: int, count: int) -> npt.NDArray[np.int64]:
    """Returns for each row (or column) of the picture the row (or column) of the window whose centre is nearest.

    Args:
        size_px: height or width of the picture.
        side: side of the windows, pixels.
        count: number of windows in this direction.
    """
    half = side // 2
    return np.minimum((np.arange(size_px) + half // 2) // half, count - 1).astype(np.int64)


def to_pixels(values: npt.NDArray[np.float32], height: int, width: int, side: int) -> npt.NDArray[np.float32]:
    """Returns for each pixel the value of the window whose centre is nearest, (H, W) float32.

    Args:
        values: (rows, columns) values of windows.
        height, width: size of the picture in pixels.
        side: side of the windows, pixels.
    """
    return values[window_of_pixels(height, side, values.shape[0])][:, window_of_pixels(width, side, values.shape[1])]


def soft_window_entropies(pictures: Tensor, side: int) -> Tensor:
    """Returns entropies of the windows of `window_entropies` that have gradients, (B, rows, columns) in bits.

    They are those of soft histograms: a pixel counts for its two nearest of 16 levels, in proportion to its nearness,
    and the histogram is smoothed over levels. They lie below those of 256 levels. The windows have `side` pixels in
    each direction, one less than those of `window_entropies`, so that each is the sum of four quarters that
    neighbouring windows share.

    Args:
        pictures: (B, 3, H, W) in 0..1.
        side: even side of the windows, pixels.
    """
    from torch.nn import functional

    shares = _shares(pictures, side)
    kernel = shares.new_tensor(SMOOTHING).view(1, 1, -1) / sum(SMOOTHING)
    smooth = functional.conv1d(shares.reshape(-1, 1, SOFT_LEVELS), kernel, padding=len(SMOOTHING) - 1)
    shares = smooth.view(*shares.shape[:3], -1)
    return -(shares * shares.clamp_min(1e-6).log2()).sum(dim=3)


def _shares(pictures: Tensor, side: int) -> Tensor:
    """The soft histograms of windows, (B, rows, columns, levels); each sums to 1."""
    import torch

    rows, columns = (torch.from_numpy(_source_pixels(size, side)) for size in pictures.shape[2:])
    grey = grey_tensor(pictures)
    extended = grey[:, rows.to(grey.device)][:, :, columns.to(grey.device)] * (SOFT_LEVELS - 1)
    half = side // 2
    batch, down, across = len(grey), len(rows) // half, len(columns) // half
    cell = (torch.arange(len(rows)) // half)[:, None] * across + torch.arange(len(columns)) // half
    cell = cell.to(grey.device)[None] + down * across * torch.arange(batch, device=grey.device)[:, None, None]
    low = extended.detach().floor().clamp(0, SOFT_LEVELS - 2)
    share = extended - low
    index = (cell * SOFT_LEVELS + low.long()).reshape(-1)
    counts = grey.new_zeros(batch * down * across * SOFT_LEVELS)
    counts = counts.index_add(0, index, (1 - share).reshape(-1)).index_add(0, index + 1, share.reshape(-1))
    windows: Tensor = _summed(counts.view(batch, down, across, SOFT_LEVELS).movedim(0, 2)).movedim(2, 0)
    return windows / (side * side)


def _source_pixels(size_px: int, side: int) -> npt.NDArray[np.int64]:
    """The row (or column) of the picture for each row (or column) of the extended picture, whole half sides."""
    half = side // 2
    extended = np.pad(np.arange(size_px), half, mode="symmetric")
    return extended[: (-(-size_px // half) + 1) * half].astype(np.int64)


def _summed(cells: Any) -> Any:
    """The sums of 2 x 2 neighbouring cells, over the first two axes of an array or a tensor."""
    return cells[:-1, :-1] + cells[1:, :-1] + cells[:-1, 1:] + cells[1:, 1:]
