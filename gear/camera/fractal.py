"""Fractal textures (sums of periodic noise at several scales), bilinear interpolation of textures, and a smooth step
function.

The noise of the camera's sensor is computed in `gear.camera.effects.noise` instead.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

TILE_PX = 1024
_FOLD = 4096


def periodic_noise(rng: np.random.Generator, octaves: Sequence[int], slope: float) -> npt.NDArray[np.float32]:
    """A fractal texture: the sum of smooth periodic noise at several scales, with values uniformly distributed over
    0..1.

    Args:
        rng: generator of the random values.
        octaves: number of grid cells per side at each scale, divisors of `TILE_PX`.
        slope: the scale with n cells has the weight n ** -slope.

    Returns:
        (`TILE_PX`, `TILE_PX`) float32 texture that repeats without seams.
    """
    total = np.zeros((TILE_PX, TILE_PX), np.float32)
    for octave in octaves:
        grid = rng.random((octave, octave)).astype(np.float32)
        # Two more cells on each side make the interpolation periodic.
        cell = TILE_PX // octave
        padded = np.pad(grid, 2, mode="wrap")
        fine = cv2.resize(padded, None, fx=cell, fy=cell, interpolation=cv2.INTER_CUBIC)
        total += fine[2 * cell : 2 * cell + TILE_PX, 2 * cell : 2 * cell + TILE_PX] * np.float32(octave**-slope)
    ranks = np.empty(total.size, np.float32)
    ranks[np.argsort(total, axis=None, kind="stable")] = np.linspace(0, 1, total.size, dtype=np.float32)
    return ranks.reshape(total.shape)


def sampled(
    picture: npt.NDArray[np.float32], x: npt.NDArray[Any], y: npt.NDArray[Any], *, is_periodic: bool = True
) -> npt.NDArray[np.float32]:
    """Bilinear interpolation of a picture at given positions.

    Args:
        picture: (H, W) or (H, W, C) float32.
        x, y: (N,) columns and rows, index pixels.
        is_periodic: whether the picture repeats. If not, positions outside it read the nearest border pixel.

    Returns:
        (N,) or (N, C) float32 interpolated values.
    """
    # OpenCV's remap takes 1 to 32767 columns, so the list is folded into rows.
    rows = max(1, -(-len(x) // _FOLD))
    height, width = picture.shape[:2]
    if is_periodic:
        x, y = x % width, y % height
    folded = [np.resize(v.astype(np.float32), (rows, _FOLD)) for v in (x, y)]
    border = cv2.BORDER_WRAP if is_periodic else cv2.BORDER_REPLICATE
    found = cv2.remap(picture, folded[0], folded[1], cv2.INTER_LINEAR, borderMode=border)
    return np.asarray(found.reshape(-1, *picture.shape[2:])[: len(x)], dtype=np.float32)


def smooth_step(value: npt.NDArray[np.float32], edge: float, width: float) -> npt.NDArray[np.float32]:
    """A smooth step function from 0 to 1, elementwise: 0 up to `edge`, 1 from `edge + width` on, and a cubic
    polynomial
    in between.

    Args:
        value: array of any shape; it is not changed.
        edge: value up to which the result is 0.
        width: distance above 0 over which the result rises to 1.
    """
    t = value - np.float32(edge)
    t *= np.float32(1 / width)
    np.clip(t, 0, 1, out=t)
    rise = np.float32(-2) * t
    rise += 3
    rise *= t
    rise *= t
    return np.asarray(rise, dtype=np.float32)
