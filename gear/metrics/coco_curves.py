"""Average precision from the matches of pycocotools, with a weight for each picture.

pycocotools matches each picture independently, so a resampled dataset needs no second matching: the matches of each
picture are counted as often as the picture was drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Draws
from gear.values.geometry import Array

RECALLS = np.linspace(0.0, 1.0, 101)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Matches:
    """The detections of one category in all pictures, by decreasing score, with the result of pycocotools'
    matching.

    Attributes:
        owner: (D,) index of the picture of each of the D detections.
        hit: (T, D) whether the detection matches a label, for each of T IoU thresholds.
        counts: (T, D) whether the detection counts, that is, is not ignored.
        label_counts: (N,) number of labels in each of N pictures that a detector should find.
    """

    owner: npt.NDArray[np.int64]
    hit: npt.NDArray[np.bool_]
    counts: npt.NDArray[np.bool_]
    label_counts: npt.NDArray[np.int64]


def matches(evaluation: Any) -> dict[int, Matches]:
    """The matches of an evaluated `COCOeval` by category id, for its first area range. Categories without a label
    that counts are left out.

    Args:
        evaluation: a `COCOeval` of pycocotools after its `evaluate`.
    """
    parameters = evaluation.params
    pictures, areas = len(parameters.imgIds), len(parameters.areaRng)
    found = {}
    for index, category in enumerate(parameters.catIds):
        first = index * areas * pictures
        rows = [(n, row) for n, row in enumerate(evaluation.evalImgs[first : first + pictures]) if row is not None]
        label_counts = np.zeros(pictures, dtype=np.int64)
        for number, row in rows:
            label_counts[number] = int(np.sum(np.asarray(row["gtIgnore"]) == 0))
        if label_counts.any():
            found[category] = _gathered(rows, label_counts, parameters.maxDets[-1], len(parameters.iouThrs))
    return found


def _gathered(rows: list[tuple[int, Any]], label_counts: npt.NDArray[np.int64], most: int, overlaps: int) -> Matches:
    scores = np.concatenate([np.asarray(row["dtScores"])[:most] for _, row in rows])
    owner = np.concatenate([np.full(len(row["dtScores"][:most]), number, dtype=np.int64) for number, row in rows])
    hit = np.concatenate([np.asarray(row["dtMatches"])[:, :most].reshape(overlaps, -1) for _, row in rows], axis=1) > 0
    ignored = np.concatenate([np.asarray(row["dtIgnore"])[:, :most].reshape(overlaps, -1) for _, row in rows], axis=1)
    surest = np.argsort(-scores, kind="stable")
    return Matches(owner=owner[surest], hit=hit[:, surest], counts=ignored[:, surest] == 0, label_counts=label_counts)


def average_precision(found: Matches, weights: npt.NDArray[np.int64]) -> Array:
    """The average precision of one category over weighted pictures, as COCO computes it: the mean precision at 101
    recalls.

    Args:
        found: the matches of the category in N pictures.
        weights: (N,) how often each picture counts.

    Returns:
        (T,) average precision for each IoU threshold, 0..1; NaN if no label counts.
    """
    total = int(weights @ found.label_counts)
    if not total:
        return np.full(len(found.hit), np.nan)
    each = weights[found.owner] * found.counts
    tp, fp = np.cumsum(each * found.hit, axis=1), np.cumsum(each * ~found.hit, axis=1)
    precision = tp / (tp + fp + np.spacing(1))
    best = np.maximum.accumulate(precision[:, ::-1], axis=1)[:, ::-1]
    values = np.zeros(len(best))
    for row in range(len(best)):
        at = np.searchsorted(tp[row] / total, RECALLS, side="left")
        values[row] = float(best[row][at[at < best.shape[1]]].sum()) / len(RECALLS)
    return values


def resampled(found: Sequence[Matches], draws: Draws) -> Array:
    """The average precision of several categories on R resampled datasets.

    Args:
        found: the matches of each category.
        draws: (R, N) picture indices; row r lists the pictures of dataset r.

    Returns:
        (R, categories, T) average precision for each of T IoU thresholds; NaN if no label counts.
    """
    values = np.full((len(draws), len(found), len(found[0].hit) if found else 1), np.nan)
    for row, drawn in enumerate(draws):
        for column, one in enumerate(found):
            values[row, column] = average_precision(one, np.bincount(drawn, minlength=len(one.label_counts)))
    return values


def known_mean(values: Array, axes: tuple[int, ...]) -> Array:
    """The mean over the given axes of all values that are not NaN; NaN where all values are NaN.

    Args:
        values: array of any shape.
        axes: the axes over which the mean is taken.
    """
    known = ~np.isnan(values)
    total = np.where(known, values, 0.0).sum(axis=axes)
    return np.asarray(np.where(known.any(axis=axes), total / np.maximum(known.sum(axis=axes), 1), np.nan))
