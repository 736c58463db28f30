"""Finds the visible pixels of all parts of objects in one pass over the id buffer (the geom id of each pixel)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.formats.pixel_runs import Runs
from gear.values.frames import GeomTable, IdImage, SceneObject

Mask = npt.NDArray[np.bool_]
PartKey = tuple[int, int]
"""Key of a part of an object: object id and label code."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class VisiblePart:
    """The visible pixels of one part of an object, such as a rider.

    Attributes:
        left_px, top_px: column and row of the mask's first pixel in the picture.
        mask: (h, w) bool, cropped to the tight box of the visible pixels.
        count_px: number of visible pixels.
    """

    left_px: int
    top_px: int
    mask: Mask
    count_px: int


def gather(table: npt.NDArray[np.generic], geom_id: IdImage) -> npt.NDArray[np.generic]:
    """The table entry of each pixel, `table[geom_id]`. The table's last entry belongs to geom id -1, which marks
    pixels without a geom.

    Args:
        table: (ngeom + 1,) one entry per geom, and a last entry for no geom.
        geom_id: (H, W) int32.

    Returns:
        (H, W) array with the table's dtype.
    """
    return np.take(table, geom_id, mode="wrap")


def visible_parts(
    geom_id: IdImage, geoms: GeomTable, objects: Mapping[int, SceneObject], *, by_label: bool
) -> dict[PartKey, VisiblePart]:
    """Finds all parts of objects that have at least one visible pixel.

    Args:
        geom_id: (H, W) int32, -1 for nothing.
        geoms: label and object of each geom.
        objects: objects to measure; geoms of other objects and of the ego car are skipped.
        by_label: True makes one part per label of an object (rider and bicycle); False one part per object, with its
            main label.

    Returns:
        The visible parts by `PartKey`: object id, and label code of the part.
    """
    runs = Runs.of(geom_id)
    keys: dict[PartKey, int] = {}
    table = np.zeros(len(geoms.object_id) + 1, dtype=np.uint16)
    for geom in np.flatnonzero(np.bincount(runs.values + 1)[1:]):
        thing = objects.get(int(geoms.object_id[geom]))
        if thing is None or thing.is_ego:
            continue
        label = int(geoms.label_code[geom]) if by_label else thing.label_code
        table[geom] = keys.setdefault((thing.id, label), len(keys) + 1)
    boxes = runs.boxes(table[runs.values])
    found: dict[PartKey, VisiblePart] = {}
    for key, number in sorted(keys.items()):
        (left, top, right, bottom), count_px = boxes[number]
        mask = gather(table, geom_id[top:bottom, left:right]) == number
        found[key] = VisiblePart(left_px=left, top_px=top, mask=mask, count_px=count_px)
    return found
