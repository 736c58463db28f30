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
    pieces: list[tuple[float, str, list[list[int]]]] = []
    for value in np.flatnonzero(np.bincount(instances.reshape(-1))):
        label = LABELS[value // INSTANCE_FACTOR if value >= INSTANCE_FACTOR else value]
        if label.id == 0:
            continue
        inside = cv2.inRange(instances, int(value), int(value))
        outlines, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        for outline in outlines:
            # A polygon through pixel centres covers half a pixel less on each side than the pixels it runs through.
            enclosed = cv2.contourArea(outline) + cv2.arcLength(outline, True) / 2 + 1
            if enclosed >= MIN_PIECE_PX:
                points = outline[:, 0, :].tolist()
                pieces.append((enclosed, label.name, points if len(points) > 2 else (points * 3)[:3]))
    pieces.sort(key=lambda piece: (-piece[0], piece[1], piece[2][0]))
    objects = [{"label": name, "polygon": points} for _, name, points in pieces]
    return {"imgHeight": height, "imgWidth": width, "objects": objects}
