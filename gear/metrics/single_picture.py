"""Detection metrics of a single picture: the share of labels that are found, and the number of false alarms.
Average precision is not defined for one picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.metrics.boxes import intersection_over_first, iou_2d
from gear.values.geometry import Array

SURE = 0.5
MIN_OVERLAP = 0.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Boxes:
    """Labels or detections of one picture, as arrays.

    Attributes:
        box_px: (N, 4) left, top, right, bottom.
        kind: (N,) class number of each box.
        weight: (N,) for labels 1 if a detector should find the label, otherwise 0; for detections the score.
    """

    box_px: Array
    kind: npt.NDArray[np.int64]
    weight: Array


def boxes(rows: Sequence[tuple[Sequence[float], int, float]]) -> Boxes:
    """Makes a `Boxes` object from tuples of box (left, top, right, bottom), class number and weight.

    Args:
        rows: one tuple per box; class numbers only need to be equal for equal classes.
    """
    return Boxes(
        box_px=np.array([box for box, _, _ in rows], dtype=np.float64).reshape(-1, 4),
        kind=np.array([kind for _, kind, _ in rows], dtype=np.int64),
        weight=np.array([weight for _, _, weight in rows], dtype=np.float64),
    )


def single_metrics(labels: Boxes, detections: Boxes, ignored_px: Array, low_px: float = 0.0) -> dict[str, float]:
    """Computes `found_share`, the share of the labels that are detected (NaN without labels), and the number of
    `false_alarms`.

    Detections with a score of at least 0.5 are matched in order of decreasing score. Each takes the label of its class
    with the largest overlap, if that overlap is at least 0.5. A detection without a label, or whose label is already
    taken, is a false alarm, unless at least half of the detection lies in an ignored box.

    Args:
        labels: labels; those with weight 0 do not count as missed.
        detections: detections.
        ignored_px: (M, 4) boxes of regions to ignore.
        low_px: detections that are lower than this height and match nothing are no false alarms.
    """
    sure = np.flatnonzero(detections.weight >= SURE)
    sure = sure[np.argsort(-detections.weight[sure], kind="stable")]
    overlaps = iou_2d(detections.box_px, labels.box_px)
    is_ignored = intersection_over_first(detections.box_px, ignored_px).max(axis=1, initial=0.0) >= MIN_OVERLAP
    is_ignored |= detections.box_px[:, 3] - detections.box_px[:, 1] < low_px
    taken, alarms = np.zeros(len(labels.kind), dtype=np.bool_), 0
    for index in sure:
        fits = np.where((labels.kind == detections.kind[index]) & ~taken, overlaps[index], 0.0)
        if fits.max(initial=0.0) >= MIN_OVERLAP:
            taken[int(np.argmax(fits))] = True
        elif not is_ignored[index]:
            alarms += 1
    return {"found_share": float(taken.mean()) if len(taken) else float("nan"), "false_alarms": float(alarms)}
