"""Bilinear interpolation of pictures in torch, at positions that a NumPy array gives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gear.values.geometry import Array

if TYPE_CHECKING:
    from torch import Tensor


def read_bilinear(light: Tensor, x: Array, y: Array) -> Tensor:
    """Reads pictures at given positions by bilinear interpolation; differentiable with respect to the pictures.

    Args:
        light: (B, C, H, W) float pictures.
        x, y: (H, W) columns and rows to read, index pixels. Positions outside the picture read its nearest border
            pixel.

    Returns:
        (B, C, H, W) values at these positions.
    """
    height, width = light.shape[-2:]
    column, row = np.clip(x, 0, width - 1).astype(np.float64), np.clip(y, 0, height - 1).astype(np.float64)
    left, top = np.floor(column).astype(np.int64), np.floor(row).astype(np.int64)
    right, bottom = np.minimum(left + 1, width - 1), np.minimum(top + 1, height - 1)
    part_x, part_y = column - left, row - top
    result = light * 0
    for rows, weight_y in ((top, 1 - part_y), (bottom, part_y)):
        for columns, weight_x in ((left, 1 - part_x), (right, part_x)):
            result = result + light[..., rows, columns] * light.new_tensor(weight_x * weight_y)
    return result
