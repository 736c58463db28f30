"""Metrics of a detector for a single picture, for which average precision is not defined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.metrics.boxes import iou_2d, share_of_first
from gear.values.geometry import Array

SURE = 0.5
MIN_OVERLAP = 0.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Boxes:
    """Labels or detections of one picture.

    Attributes:
        box_px: (N, 4) left, top, right, bottom.
        kind: (N,) number of each box's class.
        weight: (N,) for labels 1 if the label is to be found, otherwise 0; for detections the score.
    """

    box_px: Array
    kind: npt.NDArray[np.int64]
    weight: Array


def boxes(rows: Sequence[tuple[Sequence[float], int, float]]) -> Boxes:
    """Boxes from tuples of box, class and weight."""
    return Boxes(
        box_px=np.array([box for box, _, _ in rows], dtype=np.float64).reshape(-1, 4),
        kind=np.array([kind for _, kind, _ in rows], dtype=np.int64),
        weight=np.array([weight for _, _, weight in rows], dtype=np.float64),
    )


def single_metrics(labels: Boxes, found: Boxes, ignored_px: Array, low_px: float = 0.0) -> dict[str, float]:
    """`found_share`, the share of the labels that are found (NaN without labels), and the number of `false_alarms`.

    Detections with a score of at least 0.5, in order of decreasing score, each take the label of their class with the
    largest overlap, if it is at least 0.5. A detection without a label, or whose label is already taken, is a false
    alarm, unless at least half of it lies in an ignored box.

    Args:
        labels: labels; those with weight 0 need not be found.
        found: detections.
        ignored_px: (M, 4) boxes of regions to ignore.
        low_px: detections that are lower than this and match nothing are no false alarms.
    """
    sure = np.flatnonzero(found.weight >= SURE)
    sure = sure[np.argsort(-found.weight[sure], kind="stable")]
    overlaps = iou_2d(found.box_px, labels.box_px)
    excused = share_of_first(found.box_px, ignored_px).max(axis=1, initial=0.0) >= MIN_OVERLAP
    excused |= found.box_px[:, 3] - found.box_px[:, 1] < low_px
    taken, alarms = np.zeros(len(labels.kind), dtype=np.bool_), 0
    for index in sure:
        fits = np.where((labels.kind == found.kind[index]) & ~taken, overlaps[index], 0.0)
        if fits.max(initial=0.0) >= MIN_OVERLAP:
            taken[int(np.argmax(fits))] = True
        elif not excused[index]:
            alarms += 1
    return {"found_share": float(taken.mean()) if len(taken) else float("nan"), "false_alarms": float(alarms)}
