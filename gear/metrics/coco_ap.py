"""COCO's average precision of 2D detection, computed by pycocotools."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Generic, TypeVar

import numpy as np

from gear.contracts.evaluation import Draws, Spread
from gear.formats.coco import CATEGORY_NAMES, Annotation, Detection, Picture, dataset_json, results_json
from gear.metrics.coco_curves import known_mean, matches, resampled
from gear.metrics.single_picture import boxes, single_metrics
from gear.values.serial import Json

SampleT = TypeVar("SampleT", contravariant=True)

STATS = ("ap", "ap50", "ap75", "ap_small", "ap_medium", "ap_large")
RECALLS = ("ar1", "ar10", "ar100", "ar_small", "ar_medium", "ar_large")


class CocoEvaluator(Generic[SampleT]):
    """Evaluator of 2D detection: gathers pictures and detections, and computes COCO's metrics with pycocotools at
    the end.
    """

    def __init__(self, as_picture: Callable[[SampleT], Picture]) -> None:
        """Makes an evaluator without samples.

        Args:
            as_picture: function that converts a sample to its COCO picture with annotations.
        """
        self._as_picture = as_picture
        self.pictures: list[Picture] = []
        self.detections: list[tuple[Detection, ...]] = []

    def update(self, sample: SampleT, prediction: Sequence[Detection]) -> Mapping[str, float]:
        """Adds one sample with its detections; returns the metrics of this sample alone.

        The metrics are `found_share`, the share of the labels that were detected, and `false_alarms`, the number of
        wrong detections (`gear.metrics.single_picture`). Average precision is not defined for a single picture.

        Args:
            sample: a sample that `as_picture` can convert.
            prediction: the detections in its picture, of any score.

        Raises:
            ValueError: a detection has an unknown category, a box whose right is left of its left or bottom above its
                top, or a number that is not finite.
        """
        for found in prediction:
            left, top, right, bottom = found.box_px
            if found.category_id not in CATEGORY_NAMES:
                raise ValueError(f"category_id must be one of COCO's, got {found.category_id}")
            if not (right >= left and bottom >= top):
                raise ValueError(f"box_px must be left, top, right, bottom, got {found.box_px}")
            if not np.isfinite((*found.box_px, found.score)).all():
                raise ValueError(f"box_px and score must be finite, got {found.box_px} and {found.score}")
        picture = self._as_picture(sample)
        self.pictures.append(picture)
        self.detections.append(tuple(prediction))
        return self._single(picture, prediction)

    def _single(self, picture: Picture, found: Sequence[Detection]) -> dict[str, float]:
        """The metrics of a single picture."""
        return self._metrics(picture, found, 0.0)

    @staticmethod
    def _metrics(picture: Picture, found: Sequence[Detection], low_px: float) -> dict[str, float]:
        """The metrics of a single picture, where detections that are lower than `low_px` are no false alarms."""
        edges = [(_edges(item.box_xywh), item) for item in picture.annotations]
        return single_metrics(
            boxes([(box, item.category_id, 1.0) for box, item in edges if not item.is_crowd]),
            boxes([(one.box_px, one.category_id, one.score) for one in found]),
            np.array([*(box for box, item in edges if item.is_crowd), *picture.ignored_px]).reshape(-1, 4),
            low_px,
        )

    def merge(self, other: Any) -> None:
        """Adds the samples that another evaluator of this class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        self.pictures += other.pictures
        self.detections += other.detections

    def result(self) -> Mapping[str, float]:
        """The metrics by name: COCO's twelve metrics for boxes (`ap`, `ap50`, …, `ar100`, …), and `ap_<category>`
        of every labelled category; 0..1 or NaN.
        """
        names = (*STATS, *RECALLS)
        occurring = sorted({item.category_id for item in _labelled(self.pictures)})
        if not occurring:
            return {name: float("nan") for name in names}
        evaluation = self._matched()
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation.accumulate()
            evaluation.summarize()
        metrics = {name: _known(value) for name, value in zip(names, evaluation.stats, strict=True)}
        precision = evaluation.eval["precision"]
        for index, category_id in enumerate(evaluation.params.catIds):
            if category_id in occurring:
                # Axes: IoU, recall, category, area (all first), detections a picture (100 last).
                metrics[f"ap_{CATEGORY_NAMES[category_id].replace(' ', '_')}"] = float(
                    precision[:, :, index, 0, -1].mean()
                )
        return metrics

    def resampled(self, draws: Draws) -> Spread:
        """The metrics `ap`, `ap50`, `ap75` and `ap_<category>` of R resampled datasets, from which confidence
        intervals are computed.

        Args:
            draws: (R, N) sample indices in the order of the calls of `update`; row r lists the samples of dataset r.

        Returns:
            (R,) values by name of the metric; NaN where a metric is undefined.
        """
        found = matches(self._matched())
        values = resampled(list(found.values()), draws)
        spread = {
            "ap": known_mean(values, (1, 2)),
            "ap50": known_mean(values[:, :, :1], (1, 2)),
            "ap75": known_mean(values[:, :, 5:6], (1, 2)),
        }
        for column, category_id in enumerate(found):
            spread[f"ap_{CATEGORY_NAMES[category_id].replace(' ', '_')}"] = values[:, column].mean(axis=1)
        return spread

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric: 0 and 1, because every metric of this evaluator is a
        share.

        Args:
            metric: name of the metric.
        """
        return 0.0, 1.0

    def lower_is_better(self, metric: str) -> bool | None:
        """False: every metric is average precision or recall.

        Args:
            metric: name of the metric.
        """
        return False

    def _matched(self) -> Any:
        """A `COCOeval` after matching, before accumulation."""
        occurring = sorted({item.category_id for item in _labelled(self.pictures)})
        # The same picture may come twice, so pictures are numbered here.
        pictures = [
            replace(picture, id=number, annotations=(*picture.annotations, *_ignored(picture, occurring)))
            for number, picture in enumerate(self.pictures)
        ]
        truth = dataset_json(pictures, description="", created="2022-01-01")
        lines = [line for number, found in enumerate(self.detections) for line in results_json(number, found)]
        for number, line in enumerate(lines):
            line |= {"id": number + 1, "iscrowd": 0, "area": line["bbox"][2] * line["bbox"][3]}
        self._adapt(truth["annotations"], lines)
        with contextlib.redirect_stdout(io.StringIO()):
            evaluation = coco_eval(truth, lines)
            self._limit(evaluation.params)
            evaluation.evaluate()
        return evaluation

    def _adapt(self, labels: list[Json], found: list[Json]) -> None:
        """Adapts the pictures before the evaluation; subclasses may change the size of objects."""

    def _limit(self, parameters: Any) -> None:
        """Sets the parameters of the evaluation; subclasses may change limits."""


def coco_eval(truth: Json, detections: list[Json]) -> Any:
    """Makes pycocotools' `COCOeval` for 2D boxes over all of COCO's categories, from ground truth and detections
    in COCO's JSON format.

    Args:
        truth: content of an annotation file.
        detections: entries of a results file, each with the additional keys `id`, `iscrowd` and `area`.

    Returns:
        The `COCOeval`, not yet evaluated.
    """
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    labels, answers = COCO(), COCO()
    labels.dataset = truth
    answers.dataset = {"images": truth["images"], "categories": truth["categories"], "annotations": detections}
    labels.createIndex()
    answers.createIndex()
    evaluation = COCOeval(labels, answers, "bbox")
    evaluation.params.catIds = sorted(CATEGORY_NAMES)
    evaluation.params.imgIds = [picture["id"] for picture in truth["images"]]
    return evaluation


def _edges(box_xywh: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    left, top, width, height = box_xywh
    return (left, top, left + width, top + height)


def _labelled(pictures: Sequence[Picture]) -> list[Annotation]:
    return [item for picture in pictures for item in picture.annotations if not item.is_crowd]


def _ignored(picture: Picture, category_ids: Sequence[int]) -> list[Annotation]:
    """The picture's ignored boxes as pycocotools ignores a place: by a crowd of each category."""
    found = []
    for left, top, right, bottom in picture.ignored_px:
        box_xywh = (left, top, right - left, bottom - top)
        area_px = round(box_xywh[2] * box_xywh[3])
        found += [
            Annotation(category_id=category_id, box_xywh=box_xywh, area_px=area_px, rle="", is_crowd=True, extras={})
            for category_id in category_ids
        ]
    return found


def _known(value: float) -> float:
    """Replaces -1, with which pycocotools marks metrics without ground truth, by NaN."""
    return float(value) if value >= 0 else float("nan")
