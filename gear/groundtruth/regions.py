"""Finds boxes around the connected parts of a mask, such as the visible parts of a patch, and shares of objects
inside a mask.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats import rle
from gear.values.ground_truth import BoxPx


def part_boxes(mask: npt.NDArray[np.bool_]) -> tuple[BoxPx, ...]:
    """The tight box, in edge pixels, of each connected part (8 neighbours) of an (H, W) mask.

    Args:
        mask: (H, W) bool.
    """
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    boxes = []
    for left, top, width, height, _ in stats[1:count].tolist():  # the first part is what lies outside the mask
        boxes.append((float(left), float(top), float(left + width), float(top + height)))
    return tuple(boxes)


MOSTLY = 0.5
"""Share of an object's visible pixels inside a mask above which the object is ignored together with the masked
part of the picture.
"""


def share_inside(box_px: BoxPx, counts: str, mask: npt.NDArray[np.bool_]) -> float:
    """The share, 0..1, of an object's visible pixels that lie inside a mask.

    Args:
        box_px: tight box of the object's visible pixels, in edge pixels.
        counts: COCO's compressed run lengths of the object's visible pixels in the whole picture.
        mask: (H, W) bool, of the size of the picture.
    """
    left, top, right, bottom = (round(side) for side in box_px)
    crop = mask[top:bottom, left:right]
    if not crop.any():
        return 0.0
    height, width = mask.shape
    visible = rle.decode_crop(counts, height, width, (left, top, right, bottom))
    return float((visible & crop).sum() / max(1, int(visible.sum())))


def least_share_inside(box_px: BoxPx, visible_px: int, mask: npt.NDArray[np.bool_]) -> float:
    """The smallest possible share, 0..1, of an object's visible pixels that lie inside a mask.

    Only the box and the number of the visible pixels are known, so as many of them as possible are assumed to be
    outside the mask.

    Args:
        box_px: box that holds all visible pixels of the object, in edge pixels.
        visible_px: number of visible pixels of the object.
        mask: (H, W) bool, of the size of the picture.
    """
    left, top, right, bottom = (round(side) for side in box_px)
    crop = mask[top:bottom, left:right]
    outside_px = crop.size - int(crop.sum())
    return max(0.0, 1.0 - outside_px / visible_px) if crop.any() and visible_px else 0.0
