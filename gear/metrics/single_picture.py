"""What a detector does in one picture, where average precision has no meaning."""

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
        kind: (N,) number of the class.
        weight: (N,) of labels: whether it is to be found; of detections: the score.
    """

    box_px: Array
    kind: npt.NDArray[np.int64]
    weight: Array


def boxes(rows: Sequence[tuple[Sequence[float], int, float]]) -> Boxes:
    """From box, class and weight."""
    return Boxes(
        box_px=np.array([box for box, _, _ in rows], dtype=np.float64).reshape(-1, 4),
        kind=np.array([kind for _, kind, _ in rows], dtype=np.int64),
        weight=np.array([weight for _, _, weight in rows], dtype=np.float64),
    )


def single_metrics(labels: Boxes, found: Boxes, ignored_px: Array, low_px: float = 0.0) -> dict[str, float]:
    """`found_share` of the labels, NaN without any, and the number of `false_alarms`.

    Detections of at least 0.5, surest first, each take the label of their class that they overlap most, by 0.5 at
    least. What finds nothing, or a label that is taken, is a false alarm, unless half of it lies in an ignored box.

    Args:
        labels: those to be looked for.
        found: detections.
        ignored_px: (M, 4) boxes of what is not to be looked for.
        low_px: what is less high and finds nothing is no false alarm.
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
