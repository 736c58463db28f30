"""Makes the polygons of a Cityscapes polygon file from an instance map.

Each connected piece of the map is described by its outline. The polygons are sorted by the area that they enclose,
largest first. Painted in this order, they reproduce the map: a piece inside a hole of another piece encloses less area
and is painted later.

Along a diagonal line one pixel wide, the areas on its two sides touch at corners and form one 8-connected piece. A
polygon that is painted later can then cover parts of an earlier one. Additional polygons describe the pixels that are
lost in this way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats.cityscapes import INSTANCE_FACTOR, LABELS
from gear.formats.pixel_runs import Runs
from gear.values.serial import Json

MIN_PIECE_PX = 4
"""Pieces with fewer pixels are merged into their surroundings."""

MOST_REPAIRS = 8
"""Largest number of passes that add polygons for lost pixels. One pass is not enough where thin lines lie behind thin
lines.
"""


def polygons_json(instances: npt.NDArray[np.uint16]) -> Json:
    """The JSON content of a Cityscapes polygon file for one instance map.

    Args:
        instances: (H, W) uint16 map with label id * 1000 + instance number, or with the label id alone.

    Returns:
        Polygons that, painted in order, give the label map except for pieces of fewer than `MIN_PIECE_PX` pixels and
        single pixels along borders. An instance that an object in front divides into pieces has one polygon per piece.
    """
    height, width = instances.shape
    pieces = _outlines(instances)
    for _ in range(MOST_REPAIRS):
        lost = _outlines_of_lost(instances, _painted(pieces, instances.shape))
        if not lost:
            break
        pieces = sorted(pieces + lost, key=_order)
    objects = [{"label": LABELS[_label_id(piece.value)].name, "polygon": _corners(piece.outline)} for piece in pieces]
    return {"imgHeight": height, "imgWidth": width, "objects": objects}


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """A connected piece of the map: its value, its outline through pixel centres, and the enclosed area in pixels."""

    value: int
    outline: npt.NDArray[np.int32]
    enclosed_px: float


def _outlines(instances: npt.NDArray[np.uint16], x: int = 0, y: int = 0) -> list[_Piece]:
    """Pieces of a map in the order of painting, without pieces that are too small and without value 0 (unlabelled).

    Args:
        instances: an instance map, or a part of one.
        x, y: column and row of that part in the whole map.
    """
    pieces: list[_Piece] = []
    runs = Runs.of(instances)
    for value, ((left, top, right, bottom), _) in runs.boxes(runs.values).items():
        inside = cv2.inRange(instances[top:bottom, left:right], value, value)
        outlines, tree = cv2.findContours(inside, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE, offset=(x + left, y + top))
        # Holes, which have a parent, are what others paint; pieces inside holes have none.
        pieces += [
            _Piece(value, outline, _enclosed_px(outline))
            for outline, (_, _, _, parent) in zip(outlines, tree[0], strict=True)
            if parent < 0
        ]
    return sorted((piece for piece in pieces if piece.enclosed_px >= MIN_PIECE_PX), key=_order)


def _outlines_of_lost(instances: npt.NDArray[np.uint16], painted: npt.NDArray[np.uint16]) -> list[_Piece]:
    """Pieces of the pixels that painting the given pieces loses."""
    wrong = (painted != instances).view(np.uint8)
    found: list[_Piece] = []
    for outline in cv2.findContours(wrong, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]:
        if _enclosed_px(outline) >= MIN_PIECE_PX:
            x, y, width, height = cv2.boundingRect(outline)
            there = np.s_[y : y + height, x : x + width]
            inside = cv2.fillPoly(np.zeros((height, width), np.uint8), [outline], 1, offset=(-x, -y))
            found += _outlines(np.where(inside & wrong[there], instances[there], np.uint16(0)), x, y)
    return found


def _order(piece: _Piece) -> tuple[float, str, int, int]:
    x, y = piece.outline[0, 0].tolist()
    return -piece.enclosed_px, LABELS[_label_id(piece.value)].name, x, y


def _label_id(value: int) -> int:
    return value // INSTANCE_FACTOR if value >= INSTANCE_FACTOR else value


def _painted(pieces: Sequence[_Piece], shape: tuple[int, ...]) -> npt.NDArray[np.uint16]:
    """Paints pieces in order and returns the map."""
    canvas = np.zeros(shape, np.uint16)
    for piece in pieces:
        cv2.fillPoly(canvas, [piece.outline], piece.value)
    return canvas


def _enclosed_px(outline: npt.NDArray[np.int32]) -> float:
    """Number of pixels inside and on an outline through pixel centres (half a pixel inside the border)."""
    return float(cv2.contourArea(outline) + cv2.arcLength(outline, True) / 2 + 1)


def _corners(outline: npt.NDArray[np.int32]) -> list[list[int]]:
    points: list[list[int]] = outline[:, 0].tolist()
    # A piece one pixel thin has two ends; painters want three corners.
    return points if len(points) > 2 else (points * 3)[:3]
