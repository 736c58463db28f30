"""Cityscapes polygon files from instance maps.

Every connected piece of the map becomes its outline, and outlines are listed by the area that they enclose, largest
first: what lies in a hole of a piece encloses less than the piece and is painted over it, so painting in order gives
the map back.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats.cityscapes import INSTANCE_FACTOR, LABELS
from gear.formats.runs import Runs
from gear.values.serial import Json

MIN_PIECE_PX = 4
"""Smaller pieces go to what surrounds them."""


def polygons_json(instances: npt.NDArray[np.uint16]) -> Json:
    """The content of a polygon file.

    Args:
        instances: (H, W) uint16 instance map.

    Returns:
        Painted in order, it gives the label map back but for pieces under `MIN_PIECE_PX` pixels and single pixels along
        borders. An instance that something cuts into pieces is one polygon a piece.
    """
    height, width = instances.shape
    pieces: list[tuple[float, str, npt.NDArray[np.int32]]] = []
    runs = Runs.of(instances)
    # Unlabelled pixels, value 0, have no box and get no outline.
    for value, ((left, top, right, bottom), _) in runs.boxes(runs.values).items():
        label = LABELS[value // INSTANCE_FACTOR if value >= INSTANCE_FACTOR else value]
        inside = cv2.inRange(instances[top:bottom, left:right], value, value)
        outlines, tree = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(left, top))
        # Holes, which have a parent, are what others paint; pieces inside holes have none.
        pieces += [
            (_enclosed_px(outline), label.name, outline)
            for outline, (_, _, _, parent) in zip(outlines, tree[0], strict=True)
            if parent < 0
        ]
    kept = [piece for piece in pieces if piece[0] >= MIN_PIECE_PX]
    kept.sort(key=lambda piece: (-piece[0], piece[1], piece[2][0, 0, 0], piece[2][0, 0, 1]))
    objects = [{"label": name, "polygon": _corners(outline)} for _, name, outline in kept]
    return {"imgHeight": height, "imgWidth": width, "objects": objects}


def _enclosed_px(outline: npt.NDArray[np.int32]) -> float:
    """Pixels inside and on the outline, which runs through pixel centres (half a pixel inside the border)."""
    return float(cv2.contourArea(outline) + cv2.arcLength(outline, True) / 2 + 1)


def _corners(outline: npt.NDArray[np.int32]) -> list[list[int]]:
    points: list[list[int]] = outline[:, 0].tolist()
    # A piece one pixel thin has two ends; painters want three corners.
    return points if len(points) > 2 else (points * 3)[:3]
