"""How much of an even light a rough surface mirrors: the second half of Karis' split sum (2013), as a table."""

from __future__ import annotations

import numpy as np

from gear.values.geometry import Array

TABLE_PX = 32
_SAMPLES = 32


def mirrored_shares(size: int = TABLE_PX) -> Array:
    """(size, size, 2) scale and offset of the reflectance at normal incidence.

    Rows are perceptual roughness, columns the cosine between the normal and who looks, both 0..1 at the middles of
    cells. A surface of reflectance f0 mirrors f0 * scale + offset.
    """
    middles = (np.arange(size) + 0.5) / size
    cosine = middles[None, :, None]
    view = np.stack([np.sqrt(1 - cosine**2), np.zeros_like(cosine), cosine], axis=-1)
    alpha = middles[:, None, None] ** 2
    ticks = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    u, turn = (axis.reshape(1, 1, -1) for axis in np.meshgrid(ticks, 2 * np.pi * ticks))
    upright = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    aside = np.sqrt(1 - upright**2)
    half = np.stack(np.broadcast_arrays(aside * np.cos(turn), aside * np.sin(turn), upright), axis=-1)
    seen = np.maximum((half * view).sum(axis=-1), 1e-6)
    out = 2 * seen * half[..., 2] - cosine
    lit = np.maximum(out, 1e-6)
    smith = lit * np.sqrt(cosine**2 * (1 - alpha**2) + alpha**2) + cosine * np.sqrt(lit**2 * (1 - alpha**2) + alpha**2)
    weight = np.where(out > 0, 2 * lit * seen / (smith * half[..., 2]), 0.0)
    grazing = (1 - seen) ** 5
    return np.stack([(weight * (1 - grazing)).mean(axis=-1), (weight * grazing).mean(axis=-1)], axis=-1)
