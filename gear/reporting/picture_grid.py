"""Arranges pictures with captions as one picture, such as a contact sheet."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from gear.reporting.legend import FONT, FONT_SCALE, INK, PAPER
from gear.values.frames import UInt8Image

CAPTION_PX = 22
"""Height of a caption in pixels."""


def captioned(picture: UInt8Image, caption: str, width_px: int) -> UInt8Image:
    """Resizes a picture to a width and puts a caption above it; a long caption is cut.

    Args:
        picture: (H, W, 3) uint8 RGB.
        caption: one line of text.
        width_px: width of the result.

    Returns:
        (h, width_px, 3) uint8 RGB; the ratio of the picture's sides is kept.
    """
    height_px = max(1, round(picture.shape[0] * width_px / picture.shape[1]))
    way = cv2.INTER_AREA if picture.shape[1] >= width_px else cv2.INTER_LINEAR
    small = np.asarray(cv2.resize(picture, (width_px, height_px), interpolation=way), dtype=np.uint8)
    bar = np.full((CAPTION_PX, width_px, 3), PAPER, np.uint8)
    cv2.putText(bar, caption, (6, 15), FONT, FONT_SCALE, INK, 1, cv2.LINE_AA)
    return np.concatenate([bar, small])


def side_by_side(cells: Sequence[UInt8Image]) -> UInt8Image:
    """Joins pictures from left to right; lower ones are filled up at the bottom.

    Args:
        cells: (H, W, 3) uint8 RGB pictures, at least one.
    """
    height = max(cell.shape[0] for cell in cells)
    return np.concatenate([_grown(cell, height, cell.shape[1]) for cell in cells], axis=1)


def stacked(rows: Sequence[UInt8Image]) -> UInt8Image:
    """Joins pictures from top to bottom; narrower ones are filled up on the right.

    Args:
        rows: (H, W, 3) uint8 RGB pictures, at least one.
    """
    width = max(row.shape[1] for row in rows)
    return np.concatenate([_grown(row, row.shape[0], width) for row in rows])


def _grown(picture: UInt8Image, height: int, width: int) -> UInt8Image:
    grown = np.full((height, width, 3), PAPER, np.uint8)
    grown[: picture.shape[0], : picture.shape[1]] = picture
    return grown
