"""Tileable noise: everything here continues at the right edge where it starts at the left, and so downwards."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def tileable_noise(size_px: int, *, period: int, octaves: int, rng: np.random.Generator, gain: float = 0.5) -> Array:
    """Fractal value noise (size_px, size_px), zero mean, within about -1..1.

    Args:
        size_px: side of the square, a multiple of the lattice of every octave.
        period: lattice cells a side of the first octave; doubles with each octave.
        octaves: how many layers.
        rng: where the lattice values come from.
        gain: weight of each octave relative to the one before.
    """
    total = np.zeros((size_px, size_px))
    weight, norm = 1.0, 0.0
    for octave in range(octaves):
        cells = min(period * 2**octave, size_px)
        total += weight * _lattice(size_px, cells, rng.uniform(-1, 1, (cells, cells)))
        norm += weight
        weight *= gain
    total = total / norm * 1.6
    return total - float(total.mean())


def worley(size_px: int, *, cells: int, rng: np.random.Generator) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Tileable cell noise: distances to the nearest and second nearest point in cells, and the nearest's number."""
    offsets = rng.uniform(0.1, 0.9, (cells, cells, 2))
    axis = (np.arange(size_px) + 0.5) * cells / size_px
    x, y = np.meshgrid(axis, axis)
    cell_x, cell_y = np.floor(x).astype(int), np.floor(y).astype(int)
    first = np.full((size_px, size_px), 9.0)
    second = first.copy()
    nearest = np.zeros((size_px, size_px), np.int64)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            column, row = (cell_x + dx) % cells, (cell_y + dy) % cells
            point = offsets[row, column]
            distance = np.hypot(cell_x + dx + point[..., 0] - x, cell_y + dy + point[..., 1] - y)
            closer = distance < first
            second = np.where(closer, first, np.minimum(second, distance))
            nearest = np.where(closer, row * cells + column, nearest)
            first = np.where(closer, distance, first)
    return first, second, nearest


def wrapped_blur(image: Array, sigma_px: float) -> Array:
    """Gaussian blur of (H, W) or (H, W, C) that wraps at the edges."""
    rows, columns = (np.fft.fftfreq(n) for n in image.shape[:2])
    kernel = np.exp(-2 * (np.pi * sigma_px) ** 2 * (rows[:, None] ** 2 + columns[None] ** 2))
    shaped = kernel if image.ndim == 2 else kernel[..., None]
    blurred: Array = np.fft.ifft2(np.fft.fft2(image, axes=(0, 1)) * shaped, axes=(0, 1)).real
    return blurred


def _lattice(size_px: int, cells: int, values: Array) -> Array:
    axis = (np.arange(size_px) + 0.5) * cells / size_px
    low = np.floor(axis).astype(int)
    blend = axis - low
    blend = blend * blend * (3 - 2 * blend)
    low, high = low % cells, (low + 1) % cells
    rows = values[low] * (1 - blend)[:, None] + values[high] * blend[:, None]
    mixed: Array = rows[:, low] * (1 - blend) + rows[:, high] * blend
    return mixed
