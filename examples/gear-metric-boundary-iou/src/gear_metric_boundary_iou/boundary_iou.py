"""Boundary IoU (Cheng, Girshick, Dollár, Berg, Kirillov, CVPR 2021, equation 1), by class over a dataset.

The boundary of a mask is the set of its pixels that lie at most d pixels from its contour. For each class,
intersections and unions of the boundaries of ground truth and prediction are summed over all pictures, as Cityscapes
sums those of masks. As in the authors' code, a mask that the picture's border cuts has its contour there. Pixels whose
ground truth is not evaluated count nowhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from gear.formats.cityscapes import LABELS

EVALUATED = tuple(label for label in LABELS if label.is_evaluated)
"""The 19 classes of the benchmark."""

Counts = npt.NDArray[np.int64]
Values = npt.NDArray[np.float64]


class BoundaryIouEvaluator:
    """Sums of intersections and unions by class; merging adds them, so intervals are quick (`Additive`)."""

    def __init__(self, width_share: float) -> None:
        self._width_share = width_share
        self._counts: Counts = np.zeros((len(EVALUATED), 2), np.int64)

    def update(self, sample: Any, prediction: npt.NDArray[np.uint8]) -> Mapping[str, float]:
        """Takes one sample in.

        Args:
            sample: of semantic segmentation; its `label_ids` are (H, W) uint8 Cityscapes label ids.
            prediction: (H, W) uint8 label ids.

        Returns:
            `boundary_miou` of this picture.
        """
        truth = sample.label_ids
        counts = np.zeros_like(self._counts)
        width_px = max(1, round(self._width_share * math.hypot(*truth.shape)))
        counted = np.isin(truth, [label.id for label in EVALUATED])
        for number, label in enumerate(EVALUATED):
            true_mask, predicted_mask = truth == label.id, (prediction == label.id) & counted
            if not (true_mask.any() or predicted_mask.any()):
                continue
            one, other = boundary(true_mask, width_px), boundary(predicted_mask, width_px)
            counts[number] = (one & other).sum(), (one | other).sum()
        self._counts += counts
        return {"boundary_miou": _mean(counts)}

    def merge(self, other: Any) -> None:
        """Adds the counts of another evaluator."""
        self._counts += other._counts

    def result(self) -> Mapping[str, float]:
        """`boundary_miou` and `boundary_iou_<class>`, 0..1; NaN for a class that occurs nowhere."""
        return {name: float(values[0]) for name, values in self.metrics({"counts": self._counts[None]}).items()}

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """(19, 2) intersections and unions, pixels."""
        return {"counts": self._counts}

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> Mapping[str, Values]:
        """The metrics of (R, 19, 2) sums, (R,) each."""
        intersections, unions = np.moveaxis(np.asarray(totals["counts"], np.float64), -1, 0)
        ious = np.divide(intersections, unions, out=np.full_like(unions, np.nan), where=unions > 0)
        known = np.isfinite(ious)
        sums, counts = np.where(known, ious, 0).sum(axis=1), known.sum(axis=1)
        means = np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0)
        return {"boundary_miou": means} | {
            f"boundary_iou_{label.name.replace(' ', '_')}": ious[:, number] for number, label in enumerate(EVALUATED)
        }


def boundary(mask: npt.NDArray[np.bool_], width_px: int) -> npt.NDArray[np.bool_]:
    """(H, W) bool: pixels of a mask at most `width_px` steps (to any of 8 neighbours) from a pixel outside it.

    What lies beyond the picture is outside.
    """
    padded = np.pad(mask, 1).astype(np.uint8)
    inner = cv2.erode(padded, np.ones((3, 3), np.uint8), iterations=width_px)[1:-1, 1:-1]
    return mask & np.asarray(inner == 0, dtype=np.bool_)


def _mean(counts: Counts) -> float:
    present = counts[:, 1] > 0
    return float((counts[present, 0] / counts[present, 1]).mean()) if present.any() else float("nan")
