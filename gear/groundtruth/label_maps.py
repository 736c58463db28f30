"""Label and instance maps with Cityscapes ids, computed from the id buffer (the geom id of each pixel)."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats.cityscapes import INSTANCE_FACTOR
from gear.formats.pixel_runs import STRIP_ROWS, Runs
from gear.values.frames import GeomTable, IdImage, SceneObject
from gear.values.labels import LABELS

EGO_VEHICLE_ID = 1
InstanceImage = npt.NDArray[np.uint16]


def instance_map(geom_id: IdImage, geoms: GeomTable, objects: Mapping[int, SceneObject]) -> InstanceImage:
    """Computes the map of Cityscapes instance ids from an id buffer.

    Args:
        geom_id: (H, W) int32, -1 for the sky.
        geoms: label and object of each geom.
        objects: objects by id; geoms of other objects get no instance number.

    Returns:
        (H, W) uint16. The visible instances of each class are numbered from 0 in order of object id. The ego car gets
        the label `ego vehicle`.
    """
    runs = Runs.of(geom_id)
    table = np.zeros(len(geoms.object_id) + 1, dtype=np.uint16)
    table[-1] = LABELS[0].cityscapes_id
    numbers: dict[tuple[int, int], int] = {}
    used: dict[int, int] = {}
    seen = np.flatnonzero(np.bincount(runs.values + 1)[1:])
    for geom in seen[np.argsort(geoms.object_id[seen], kind="stable")]:
        label = LABELS[int(geoms.label_code[geom])]
        thing = objects.get(int(geoms.object_id[geom]))
        table[geom] = label.cityscapes_id
        if thing is None:
            continue
        if thing.is_ego:
            table[geom] = EGO_VEHICLE_ID
        elif label.is_instance:
            key = (label.cityscapes_id, thing.id)
            if key not in numbers:
                numbers[key] = used.get(label.cityscapes_id, 0)
                used[label.cityscapes_id] = numbers[key] + 1
            if numbers[key] < INSTANCE_FACTOR:
                table[geom] = label.cityscapes_id * INSTANCE_FACTOR + numbers[key]
    # The table's last entry is what -1, nothing, finds.
    return runs.painted(table[runs.values])


def label_map(instances: InstanceImage) -> npt.NDArray[np.uint8]:
    """The (H, W) uint8 map of Cityscapes label ids for an (H, W) uint16 map of instance ids.

    Args:
        instances: (H, W) uint16 instance ids: label id * 1000 + number for countable labels, otherwise the label id.
    """
    labels = np.empty(instances.shape, np.uint8)
    for top in range(0, len(instances), STRIP_ROWS):
        strip = instances[top : top + STRIP_ROWS]
        of_instance = strip // np.uint16(INSTANCE_FACTOR)
        labels[top : top + STRIP_ROWS] = np.where(of_instance > 0, of_instance, strip)
    return labels


def coarsen(instances: InstanceImage, window_px: int) -> InstanceImage:
    """Simplifies a label map to the precision of an annotator with a polygon tool.

    Each pixel takes the most frequent label in the square around the pixel, and the most frequent instance of that
    label. Structures that are thinner than about half the window (wires, thin poles, single leaves), and equally small
    gaps (sky between twigs), take the label of their surroundings. Straight borders do not move.

    Args:
        instances: (H, W) uint16 instance map.
        window_px: side of the square, odd.
    """
    labels = _filling(label_map(instances).astype(np.uint16), window_px)
    return _filling(instances, window_px, labels)


def _filling(values: InstanceImage, window_px: int, labels: InstanceImage | None = None) -> InstanceImage:
    """The most frequent value in the square around each pixel; if (H, W) label ids are given, among the values with the
    pixel's label.
    """
    height, width = values.shape
    best_count = np.zeros((height, width), dtype=np.int16)
    best: InstanceImage = values.copy()
    reach = window_px // 2
    for value in np.unique(values):
        inside = values == value
        rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        y0, y1 = max(0, int(rows[0]) - reach), min(height, int(rows[-1]) + 1 + reach)
        x0, x1 = max(0, int(columns[0]) - reach), min(width, int(columns[-1]) + 1 + reach)
        around = np.s_[y0:y1, x0:x1]
        crop = inside[around].astype(np.uint8)
        border = cv2.BORDER_CONSTANT
        count = cv2.boxFilter(crop, cv2.CV_16S, (window_px, window_px), normalize=False, borderType=border)
        # A tie stays with the pixel's own label.
        count = np.asarray(count * 2 + crop, dtype=np.int16)
        wins = count > best_count[around]
        if labels is not None:
            wins &= labels[around] == (value // INSTANCE_FACTOR or value)
        best_count[around][wins] = count[wins]
        best[around][wins] = value
    return best
