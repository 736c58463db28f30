"""Encodes pictures for the HTML page as small WebP files, because the page contains all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from gear.values.frames import UInt8Image

MEDIA_TYPE = "image/webp"
QUALITY = 80
SCALES = (1.0, 0.8, 0.65, 0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1)
"""Allowed scales of embedded pictures. One scale is used for the whole page, so samples can be compared."""

MOST_PX = 16383
"""Largest side of a WebP picture in pixels."""

LEAST_WIDTH_PX = 160
"""Smallest width of an embedded picture in pixels, even if the page then exceeds its budget."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One encoded picture of the page.

    Attributes:
        data: encoded bytes (WebP).
        width_px, height_px: size of the original picture.
        is_whole: whether the encoded picture has the size of the original.
    """

    data: bytes
    width_px: int
    height_px: int
    is_whole: bool


def encode(pixels: UInt8Image, scale: float) -> Picture:
    """Resizes a (H, W, 3) uint8 RGB picture by area averaging and compresses it as WebP.

    Args:
        pixels: the picture.
        scale: factor for width and height. Pictures are not made narrower than `LEAST_WIDTH_PX`, nor larger than
            `MOST_PX`.
    """
    height, width = pixels.shape[:2]
    target = max(round(width * scale), min(width, LEAST_WIDTH_PX))
    target = max(1, min(target, MOST_PX, MOST_PX * width // height))
    small = pixels
    if target < width:
        size = (target, max(1, round(height * target / width)))
        small = np.asarray(cv2.resize(pixels, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    done, data = cv2.imencode(".webp", small[..., ::-1], [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    if not done:
        raise ValueError(f"cannot encode a picture of shape {pixels.shape}")
    return Picture(data.tobytes(), width, height, is_whole=small is pixels)


def largest_scale(probes: Sequence[Sequence[UInt8Image]], samples: int, budget_bytes: float) -> float:
    """Returns the largest of `SCALES` at which the pictures of all samples fit the budget, estimated from a few
    samples.

    If the pictures fit at no scale, the result is the smallest scale.

    Args:
        probes: all pictures of a few samples, one list per sample.
        samples: number of all samples.
        budget_bytes: budget for all encoded pictures.
    """
    for scale in SCALES:
        allowed = budget_bytes * len(probes) / samples
        for pixels in (pixels for pictures in probes for pixels in pictures):
            allowed -= len(encode(pixels, scale).data)
            if allowed < 0:
                break
        else:
            return scale
    return SCALES[-1]
