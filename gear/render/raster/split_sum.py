"""Table of the environment BRDF, the second factor of the split-sum approximation (Karis 2013)."""

from __future__ import annotations

from functools import cache

import numpy as np

from gear.values.geometry import Array, frozen

TABLE_PX = 32
_SAMPLES = 32


@cache
def split_sum_table(size: int = TABLE_PX) -> Array:
    """Computes the table of scale and offset with which a rough surface reflects the share f0 * scale + offset of
    uniform light. f0 is the reflectance at normal incidence.

    Args:
        size: number of rows and of columns of the table.

    Returns:
        (size, size, 2) float64, read-only: scale and offset. Rows are perceptual roughness, columns are the cosine
        between the normal and the direction to the camera; the values of rows and columns are 0..1, at the centres of
        cells.
    """
    middles = (np.arange(size) + 0.5) / size
    cosine = middles[None, :, None]
    alpha = middles[:, None, None] ** 2
    ticks = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    u, turn = (axis.reshape(1, 1, -1) for axis in np.meshgrid(ticks, 2 * np.pi * ticks))
    upright = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    aside = np.sqrt(1 - upright**2)
    seen = np.maximum(aside * np.cos(turn) * np.sqrt(1 - cosine**2) + upright * cosine, 1e-6)
    out = 2 * seen * upright - cosine
    lit = np.maximum(out, 1e-6)
    smith = lit * np.sqrt(cosine**2 * (1 - alpha**2) + alpha**2) + cosine * np.sqrt(lit**2 * (1 - alpha**2) + alpha**2)
    weight = np.where(out > 0, 2 * lit * seen / (smith * upright), 0.0)
    grazing = (1 - seen) ** 5
    shares = [(weight * (1 - grazing)).mean(axis=-1), (weight * grazing).mean(axis=-1)]
    return frozen(np.stack(shares, axis=-1))
