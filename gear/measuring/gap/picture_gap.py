"""How far two pictures are apart where a patch is seen, and elsewhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.formats import rle
from gear.values.frames import UInt8Image
from gear.values.ground_truth import SurfaceTruth

Mask = npt.NDArray[np.bool_]

PERFECT_DB = 99.0
"""What equal pictures are given instead of infinity."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureGap:
    """Digital against rendered, in one picture.

    Attributes:
        psnr_db: over the pixels that show a patch; sRGB bytes, at most `PERFECT_DB`.
        worst: largest difference there, in levels of 255.
        outside_rms: root mean square over all other pixels, in levels.
        outside_worst: largest difference there.
        outside_px: other pixels that differ at all.
    """

    psnr_db: float
    worst: int
    outside_rms: float
    outside_worst: int
    outside_px: int


def visible_mask(surfaces: Sequence[SurfaceTruth], view: str, height_px: int, width_px: int) -> Mask:
    """(H, W) where a view shows any of the surfaces, by ids."""
    mask = np.zeros((height_px, width_px), np.bool_)
    for surface in surfaces:
        if surface.camera == view and surface.visible_px:
            mask |= rle.decode(surface.mask_rle, height_px, width_px)
    return mask


def picture_gap(digital: UInt8Image, rendered: UInt8Image, mask: Mask) -> PictureGap:
    """Compares (H, W, 3) pictures inside and outside a mask that is not empty."""
    difference = np.abs(digital.astype(np.int16) - rendered)
    inside, outside = difference[mask], difference[~mask]
    return PictureGap(
        psnr_db=psnr_db(float((inside.astype(np.float64) ** 2).mean())),
        worst=int(inside.max()),
        outside_rms=math.sqrt(float((outside.astype(np.float64) ** 2).mean())) if outside.size else 0.0,
        outside_worst=int(outside.max(initial=0)),
        outside_px=int(outside.any(axis=-1).sum()),
    )


def psnr_db(mean_square: float) -> float:
    """Peak signal to noise ratio of a mean squared difference in levels of 255."""
    return min(PERFECT_DB, 10 * math.log10(255**2 / mean_square)) if mean_square > 0 else PERFECT_DB
