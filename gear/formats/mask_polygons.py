"""Converts masks of objects to polygons along the borders of their pixels, in COCO's form.

The polygons run through the corners of pixels, in edge pixels. pycocotools fills the pixels whose centres lie inside a
polygon, so it restores the same mask. A COCO polygon cannot have a hole; a piece with a hole is therefore cut in two
through the hole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gear.formats import coco, rle

Mask = npt.NDArray[np.bool_]
Ints = npt.NDArray[np.int64]
Ring = tuple[tuple[int, int], ...]


def mask_polygons(mask: Mask, left_px: int = 0, top_px: int = 0) -> list[list[int]]:
    """Converts a mask to polygons that cover exactly its pixels.

    Args:
        mask: (h, w) bool mask, a crop of the picture.
        left_px, top_px: column and row of the mask's first pixel in the picture.

    Returns:
        Corners `x, y, x, y, ...` of each polygon in edge pixels. The polygons do not overlap and have no holes. Pieces
        of the mask that touch only at corners are separate polygons.
    """
    polygons: list[list[int]] = []
    parts = [(mask, left_px, top_px)]
    while parts:
        part, x, y = parts.pop()
        rings, hole_column = _rings(part)
        if hole_column:
            # From right to left, so that the left half comes first.
            parts += [(part[:, hole_column:], x + hole_column, y), (part[:, :hole_column], x, y)]
        else:
            polygons += [[value for px, py in ring for value in (px + x, py + y)] for ring in rings]
    return polygons


def _rings(mask: Mask) -> tuple[list[Ring], int]:
    """Borders of a mask's 4-connected pieces through the corners of pixels.

    Returns:
        The closed borders, and a column at which to cut: 0 if no piece has a hole, otherwise a column with a pixel of a
        hole to its left.
    """
    padded = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2), dtype=np.int64)
    padded[1:-1, 1:-1] = mask
    corners = _corners(padded)
    if not len(corners):
        return [], 0
    x, y = corners[:, 0], corners[:, 1]
    # Corners on one grid line are joined in pairs: the first with the second, the third with the fourth.
    along_row = _partners(np.lexsort((corners[:, 2], x, y)))
    along_column = _partners(np.lexsort((corners[:, 3], y, x)))
    xs, ys = x.tolist(), y.tolist()
    is_seen = [False] * len(xs)
    rings: list[Ring] = []
    # Corners come row by row, so the first one of a ring is its topmost and of those its leftmost.
    for first in range(len(xs)):
        if is_seen[first]:
            continue
        if not padded[ys[first] + 1, xs[first] + 1]:
            return [], xs[first] + 1
        ring: list[tuple[int, int]] = []
        here = first
        while not is_seen[here]:
            other = along_row[here]
            is_seen[here] = is_seen[other] = True
            ring += [(xs[here], ys[here]), (xs[other], ys[other])]
            here = along_column[other]
        rings.append(tuple(ring))
    return rings, 0


def _corners(padded: Ints) -> Ints:
    """(N, 4) corners of the borders, row by row: x, y in edge pixels of the mask, whether the border leaves to the
    right (otherwise to the left), and whether it leaves downwards (otherwise upwards).

    Where two pixels of the mask meet only at a corner, each of them has a corner of its own there.

    Args:
        padded: (h + 2, w + 2) mask of 0 and 1 with a margin of zeros.
    """
    code = padded[:-1, :-1] + 2 * padded[:-1, 1:] + 4 * padded[1:, :-1] + 8 * padded[1:, 1:]
    y, x = np.nonzero(_TURNS[code, 0] >= 0)
    found = code[y, x]
    turns = [np.column_stack([x, y, _TURNS[found, 0], _TURNS[found, 1]])]
    is_double = _TURNS[found, 2] >= 0
    turns.append(np.column_stack([x, y, _TURNS[found, 2], _TURNS[found, 3]])[is_double])
    both = np.concatenate(turns)
    return both[np.lexsort((both[:, 2], both[:, 0], both[:, 1]))]


def _turns() -> Ints:
    """(16, 4) table by which of the four pixels around a corner are set (1 top left, 2 top right, 4 bottom left, 8
    bottom right): whether the border leaves to the right and downwards, for the first and for a second corner at this
    point; -1 if there is none.
    """
    turns = np.full((16, 4), -1)
    # A lone pixel's border, and that around a lone gap, turns towards that pixel.
    towards = {1: (0, 0), 2: (1, 0), 4: (0, 1), 8: (1, 1)}
    for pixel, turn in towards.items():
        turns[pixel, :2] = turns[15 - pixel, :2] = turn
    for one, other in ((1, 8), (2, 4)):
        turns[one | other] = (*towards[one], *towards[other])
    return turns


_TURNS = _turns()


def _partners(order: Ints) -> list[int]:
    """For each corner the index of the one that it is connected with; `order` lists the corners along their
    grid lines.
    """
    partners = np.empty(len(order), dtype=np.int64)
    partners[order[0::2]], partners[order[1::2]] = order[1::2], order[0::2]
    return [int(one) for one in partners]


def joined_polygons(polygons: Sequence[Sequence[int]]) -> list[int]:
    """Joins several polygons to one polygon, for formats that have one polygon per object.

    Each polygon is joined to the polygons before it by a bridge of width 0 between their two nearest corners. The
    filled result covers the same area as the separate polygons.

    Args:
        polygons: corners `x, y, x, y, ...` of each polygon; at least one polygon.

    Returns:
        The corners `x, y, x, y, ...` of the joined polygon.
    """
    ring = np.asarray(polygons[0], dtype=np.int64).reshape(-1, 2)
    for polygon in polygons[1:]:
        piece = np.asarray(polygon, dtype=np.int64).reshape(-1, 2)
        distances = ((ring[:, None] - piece[None]) ** 2).sum(axis=2)
        here, there = divmod(int(distances.argmin()), len(piece))
        ring = np.concatenate([ring[: here + 1], np.roll(piece, -there, axis=0), piece[there : there + 1], ring[here:]])
    return [int(value) for value in ring.reshape(-1)]


def with_polygons(item: coco.Annotation, picture: coco.Picture) -> coco.Annotation:
    """Replaces the mask of a COCO annotation by polygons that cover the same pixels.

    Args:
        item: the annotation.
        picture: the picture to which it belongs, which gives the mask's size.

    Returns:
        A new annotation; that of a crowd is returned unchanged, because COCO stores crowds as run lengths.
    """
    if item.is_crowd:
        return item
    left, top, width, height = (round(side) for side in item.box_xywh)
    mask = rle.decode_crop(item.rle, picture.height_px, picture.width_px, (left, top, left + width, top + height))
    return replace(item, polygons=mask_polygons(mask, left, top))
