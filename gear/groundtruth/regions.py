"""Boxes around the connected parts of a mask, such as the visible parts of a patch."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.ground_truth import BoxPx


def part_boxes(mask: npt.NDArray[np.bool_]) -> tuple[BoxPx, ...]:
    """The tight box of each connected part (8 neighbours) of an (H, W) mask, in edge pixels."""
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    boxes = []
    for left, top, width, height, _ in stats[1:count].tolist():  # the first part is what lies outside the mask
        boxes.append((float(left), float(top), float(left + width), float(top + height)))
    return tuple(boxes)


MOSTLY = 0.5
"""An object with a larger share of its visible pixels in a mask is ignored with the mask."""


def least_share_inside(box_px: BoxPx, visible_px: int, mask: npt.NDArray[np.bool_]) -> float:
    """Least share of an object's visible pixels that lies in a mask, 0..1.

    Which pixels of the box are the object's is not known: as many as possible may lie outside the mask.

    Args:
        box_px: that holds all visible pixels; edge pixels.
        visible_px: their number.
        mask: (H, W) of the picture.
    """
    left, top, right, bottom = (round(side) for side in box_px)
    crop = mask[top:bottom, left:right]
    outside_px = crop.size - int(crop.sum())
    return max(0.0, 1.0 - outside_px / visible_px) if crop.any() and visible_px else 0.0
