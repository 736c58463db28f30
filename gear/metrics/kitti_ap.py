"""KITTI's object evaluation: average precision of 2D boxes, of footprints and of 3D boxes, and orientation
similarity.

The evaluation follows the rules of the devkit. It uses up to 41 score thresholds. Labels of similar classes and labels
beyond the difficulty are ignored, and detections in DontCare regions are no false alarms. `r11` is the mean precision
over 11 recalls; `r40` is the mean over 40 recalls, which replaced `r11` in 2019. With fewer than 41 labels of a class a
perfect detector stays below 1 in both means, because fewer recall steps exist. This is the benchmark's own definition;
`ceilings` gives the largest possible values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np

from gear.contracts.evaluation import Draws, Spread
from gear.formats.kitti_object import TYPES, KittiLabel
from gear.metrics.kitti_match import (
    DIFFICULTIES,
    NEIGHBOURS,
    OVERLAPS,
    Chosen,
    Counts,
    Difficulty,
    Overlap,
    PictureBoxes,
    choose,
    count,
    matched_scores,
    picture_boxes,
)
from gear.metrics.single_picture import boxes, single_metrics
from gear.values.geometry import Array
from gear.values.ground_truth import BoxPx

SampleT = TypeVar("SampleT", contravariant=True)

STEPS = 40
"""Number of recall steps; the recalls at which precision is measured are multiples of 1/40."""


class KittiEvaluator(Generic[SampleT]):
    """Evaluator of KITTI's object metrics: gathers the labels and detections of all pictures, and computes the
    metrics at the end.
    """

    def __init__(
        self,
        labels_of: Callable[[SampleT], Sequence[KittiLabel]],
        ignored_of: Callable[[SampleT], Sequence[BoxPx]] = lambda _: (),
    ) -> None:
        """Makes an evaluator without samples.

        Args:
            labels_of: function that returns the lines of a sample's label file, including DontCare regions.
            ignored_of: function that returns a sample's ignored 2D boxes in index pixels.
        """
        self._labels_of, self._ignored_of = labels_of, ignored_of
        self.pictures: list[PictureBoxes] = []

    def update(self, sample: SampleT, prediction: Sequence[KittiLabel]) -> Mapping[str, float]:
        """Adds one sample with its detections; returns the metrics of its 2D boxes alone.

        The metrics are `found_share`, the share of the labels that were detected, and `false_alarms`, the number of
        wrong detections (`gear.metrics.single_picture`). Average precision is not defined for a single picture.

        Args:
            sample: a sample that `labels_of` can convert.
            prediction: the detections in its left picture, each with a score.

        Raises:
            ValueError: a detection has no score, a type that is none of KITTI's, a box whose right is left of its left
                or bottom above its top, or a number that is not finite.
        """
        for found in prediction:
            _check(found)
        labels = self._labels_of(sample)
        ignored_px = self._ignored_of(sample)
        self.pictures.append(picture_boxes(labels, prediction, ignored_px))
        wanted = [label for label in labels if label.type in NEIGHBOURS]
        return single_metrics(
            boxes([(label.box_px, TYPES.index(label.type), 1.0) for label in wanted]),
            boxes(
                [(one.box_px, TYPES.index(one.type), one.score or 0.0) for one in prediction if one.type in NEIGHBOURS]
            ),
            np.array([*(label.box_px for label in labels if label.type not in NEIGHBOURS), *ignored_px]).reshape(-1, 4),
        )

    def merge(self, other: Any) -> None:
        """Adds the pictures that another evaluator of this class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        self.pictures += other.pictures

    def result(self) -> Mapping[str, float]:
        """The metrics by name, 0..1; NaN where no label counts.

        Names are `<class>_<2d|bev|3d>_<easy|moderate|hard>_<r11|r40>`, `<class>_aos_…` (orientation similarity), and
        `ap_3d_moderate`, the mean of the classes' `3d_moderate_r40`.
        """
        metrics: dict[str, float] = {}
        for kind in NEIGHBOURS:
            for overlap in OVERLAPS:
                for difficulty in DIFFICULTIES:
                    self._add(metrics, kind, difficulty, overlap)
        known = [v for k in NEIGHBOURS if (v := metrics[f"{k.lower()}_3d_moderate_r40"]) == v]
        return {"ap_3d_moderate": float(np.mean(known)) if known else float("nan"), **metrics}

    def resampled(self, draws: Draws) -> Spread:
        """The metrics `<class>_<2d|bev|3d>_moderate_r40` and `ap_3d_moderate` of R resampled datasets, from which
        confidence intervals are computed.

        Args:
            draws: (R, N) sample indices in the order of the calls of `update`; row r lists the samples of dataset r.

        Returns:
            (R,) values by name of the metric; NaN where no label counts.
        """
        moderate = next(difficulty for difficulty in DIFFICULTIES if difficulty.name == "moderate")
        spread: dict[str, Array] = {}
        for kind in NEIGHBOURS:
            for overlap in OVERLAPS:
                chosen = [choose(picture, kind, moderate, overlap) for picture in self.pictures]
                spread[f"{kind.lower()}_{overlap}_moderate_r40"] = resampled_r40(chosen, draws)
        classes = np.array([spread[f"{kind.lower()}_3d_moderate_r40"] for kind in NEIGHBOURS])
        known = ~np.isnan(classes)
        total = np.where(known, classes, 0.0).sum(axis=0)
        spread["ap_3d_moderate"] = np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan)
        return spread

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric: 0 and 1, because every metric of this evaluator is a
        share.

        Args:
            metric: name of the metric.
        """
        return 0.0, 1.0

    def lower_is_better(self, metric: str) -> bool | None:
        """False: every metric is an average precision or similarity.

        Args:
            metric: name of the metric.
        """
        return False

    def ceilings(self) -> Mapping[str, float]:
        """The values that perfect detections would reach, by name of the metric; only metrics whose value would be
        below 1.
        """
        most: dict[str, float] = {}
        for kind in NEIGHBOURS:
            for overlap in OVERLAPS:
                for difficulty in DIFFICULTIES:
                    curve = perfect_curve(choose(picture, kind, difficulty, overlap) for picture in self.pictures)
                    for name in (overlap, "aos") if overlap == "2d" else (overlap,):
                        most |= _at_recalls(f"{kind.lower()}_{name}_{difficulty.name}", curve)
        known = [v for k in NEIGHBOURS if (v := most[f"{k.lower()}_3d_moderate_r40"]) == v]
        most = {"ap_3d_moderate": float(np.mean(known)) if known else 1.0, **most}
        return {name: value for name, value in most.items() if value < 1}

    def _add(self, metrics: dict[str, float], kind: str, difficulty: Difficulty, overlap: Overlap) -> None:
        chosen = [choose(picture, kind, difficulty, overlap) for picture in self.pictures]
        precision, orientation = curves(chosen)
        curve_by_name = {overlap: precision} | ({"aos": orientation} if overlap == "2d" else {})
        for name, curve in curve_by_name.items():
            metrics |= _at_recalls(f"{kind.lower()}_{name}_{difficulty.name}", curve)


def _check(found: KittiLabel) -> None:
    """Raises `ValueError` for a detection that cannot be evaluated and would otherwise count as a false alarm."""
    if found.score is None:
        raise ValueError("every detection needs a score")
    if found.type not in TYPES:
        raise ValueError(f"type must be one of {', '.join(TYPES)}, got {found.type!r}")
    left, top, right, bottom = found.box_px
    body = (found.alpha_rad, found.height_m, found.width_m, found.length_m, *found.location_m, found.rotation_y_rad)
    if not np.isfinite((*found.box_px, *body, found.score)).all():
        raise ValueError(f"every number of a detection must be finite, got {found}")
    if right < left or bottom < top:
        raise ValueError(f"box_px must be left, top, right, bottom, got {found.box_px}")


def resampled_r40(chosen: Sequence[Chosen], draws: Draws) -> Array:
    """The (R,) average precision at 40 recalls of R resampled datasets; NaN where no label counts.

    Row r of the (R, N) draws lists the picture indices of dataset r. Every picture is matched only once, at all
    thresholds that occur in any draw.

    Args:
        chosen: labels and detections of each picture, sorted for one class and difficulty by `choose`.
        draws: (R, N) picture indices.
    """
    label_counts = np.array([int((picture.label_state == 0).sum()) for picture in chosen])
    scores = [(score, number) for number, picture in enumerate(chosen) for score in matched_scores(picture)]
    scores.sort(reverse=True)
    ordered, owners = np.array([s for s, _ in scores]), np.array([n for _, n in scores], dtype=np.int64)
    thresholds = np.unique(ordered)[::-1]
    parts = [count(picture, thresholds) for picture in chosen] if len(thresholds) else []
    hits, alarms = np.array([part.tp for part in parts]), np.array([part.fp for part in parts])
    values = np.full(len(draws), np.nan)
    for row, drawn in enumerate(draws):
        weights = np.bincount(drawn, minlength=len(chosen))
        total = int(weights @ label_counts)
        if not total:
            continue
        drawn_scores = np.repeat(ordered, weights[owners]) if len(ordered) else ordered
        steps = recall_thresholds(drawn_scores.tolist(), total)
        columns = len(thresholds) - 1 - np.searchsorted(thresholds[::-1], steps)
        tp = weights @ hits[:, columns] if len(steps) else np.zeros(1)
        fp = weights @ alarms[:, columns] if len(steps) else np.zeros(1)
        values[row] = _monotone(tp / np.maximum(tp + fp, 1.0))[1:].mean()
    return values


def curves(chosen: Sequence[Chosen]) -> tuple[Array, Array]:
    """The (41,) precision and the (41,) orientation similarity at recalls 0, 1/40, …, 1; NaN if no label counts.

    Args:
        chosen: labels and detections of each picture, sorted for one class and difficulty by `choose`.
    """
    label_count = sum(int((picture.label_state == 0).sum()) for picture in chosen)
    if not label_count:
        return np.full(STEPS + 1, np.nan), np.full(STEPS + 1, np.nan)
    scores = sorted((score for picture in chosen for score in matched_scores(picture)), reverse=True)
    thresholds = recall_thresholds(scores, label_count)
    total = Counts(tp=np.zeros(1), fp=np.zeros(1), fn=np.zeros(1), similarity=np.zeros(1))
    if len(thresholds):
        parts = [count(picture, thresholds) for picture in chosen]
        total = Counts(
            tp=np.sum([part.tp for part in parts], axis=0),
            fp=np.sum([part.fp for part in parts], axis=0),
            fn=np.sum([part.fn for part in parts], axis=0),
            similarity=np.sum([part.similarity for part in parts], axis=0),
        )
    found = np.maximum(total.tp + total.fp, 1.0)
    return _monotone(total.tp / found), _monotone(total.similarity / found)


def perfect_curve(chosen: Iterable[Chosen]) -> Array:
    """The (41,) precision at recalls 0, 1/40, …, 1 that perfect detections would reach; below 1 at the end for
    fewer than 41 labels.

    Args:
        chosen: labels and detections of each picture, sorted by `choose`; only the labels are used.
    """
    label_count = sum(int((picture.label_state == 0).sum()) for picture in chosen)
    if not label_count:
        return np.full(STEPS + 1, np.nan)
    return _monotone(np.ones(len(recall_thresholds(range(label_count, 0, -1), label_count))))


def recall_thresholds(scores: Sequence[float], label_count: int) -> Array:
    """The score thresholds at which KITTI's evaluation measures precision: the scores at which the recall reaches
    each step of 1/40.

    Args:
        scores: scores of the detections that match a label.
        label_count: number of labels that count.

    Returns:
        At most 41 scores, in decreasing order.
    """
    thresholds = []
    recall = 0.0
    for i, score in enumerate(scores):
        is_last = i == len(scores) - 1
        here = (i + 1) / label_count
        following = here if is_last else (i + 2) / label_count
        if following - recall < recall - here and not is_last:
            continue
        thresholds.append(score)
        recall += 1.0 / STEPS
    return np.array(thresholds)


def _at_recalls(stem: str, curve: Array) -> dict[str, float]:
    """Means of a (41,) curve over 11 and over 40 recalls."""
    return {f"{stem}_r11": float(curve[:: STEPS // 10].mean()), f"{stem}_r40": float(curve[1:].mean())}


def _monotone(values: Array) -> Array:
    """The largest value at each recall or any higher one, padded with zeros to 41 values."""
    curve = np.zeros(STEPS + 1)
    kept = values[: STEPS + 1]
    curve[: len(kept)] = np.maximum.accumulate(kept[::-1])[::-1]
    return curve
