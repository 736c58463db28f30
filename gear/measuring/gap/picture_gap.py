"""The difference between two pictures, inside and outside the visible patch."""

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
"""PSNR in dB that is reported for equal pictures, for which the PSNR is infinite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureGap:
    """The difference between a picture with a composed patch (pasted by a compositor) and one with a rendered
    patch.

    Attributes:
        psnr_db: peak signal-to-noise ratio in dB over the patch's pixels, from sRGB values 0..255; at most
            `PERFECT_DB`.
        worst: largest difference in the patch's pixels, in levels of 0..255.
        outside_rms: root mean square difference over all pixels outside the patch, in levels of 0..255.
        outside_worst: largest difference in the pixels outside the patch, in levels of 0..255.
        outside_px: number of pixels outside the patch that differ.
    """

    psnr_db: float
    worst: int
    outside_rms: float
    outside_worst: int
    outside_px: int


def visible_mask(surfaces: Sequence[SurfaceTruth], view: str, height_px: int, width_px: int) -> Mask:
    """The (H, W) bool mask of the pixels in one view that show a patch surface, decoded from the ground truth.

    Args:
        surfaces: ground truth of the surfaces in all views.
        view: name of the camera.
        height_px, width_px: size of the picture.
    """
    mask = np.zeros((height_px, width_px), np.bool_)
    for surface in surfaces:
        if surface.camera == view and surface.visible_px:
            mask |= rle.decode(surface.mask_rle, height_px, width_px)
    return mask


def picture_gap(digital: UInt8Image, rendered: UInt8Image, mask: Mask) -> PictureGap:
    """Compares two (H, W, 3) uint8 pictures inside and outside a (H, W) bool mask of the patch, which must not be
    empty.

    Args:
        digital: picture with composed patches.
        rendered: picture with rendered patches.
        mask: pixels that show a patch.
    """
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
    """The peak signal-to-noise ratio in dB, at most `PERFECT_DB`.

    Args:
        mean_square: mean squared difference of pixel values in 0..255.
    """
    return min(PERFECT_DB, 10 * math.log10(255**2 / mean_square)) if mean_square > 0 else PERFECT_DB
