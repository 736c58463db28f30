"""Metrics of semantic segmentation by the definitions of Cityscapes: IoU of classes and categories, and iIoU.

Pixels whose ground truth is not evaluated are skipped. A class that occurs neither in ground truth nor in predictions
is left out of the mean. For iIoU every pixel of an instance has the weight (average instance size of the class) / (size
of the instance).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from gear.formats.cityscapes import INSTANCE_FACTOR, LABELS, CityscapesLabel

AVERAGE_INSTANCE_PX: dict[str, float] = {
    "bicycle": 4672.3249222261,
    "caravan": 36771.8241758242,
    "motorcycle": 6298.7200839748,
    "rider": 3930.4788056518,
    "bus": 35732.1511111111,
    "train": 67583.7075812274,
    "car": 12794.0202738185,
    "person": 3462.4756337644,
    "truck": 27855.1264367816,
    "trailer": 16926.9763313609,
}
"""Average size in pixels of an instance of each class in Cityscapes' training set."""

EVALUATED = tuple(label for label in LABELS if label.is_evaluated)
CATEGORIES = tuple(dict.fromkeys(label.category for label in EVALUATED))
COUNT = len(LABELS)

PIECE_PX = 1 << 17

Values = npt.NDArray[np.float64]
"""The value of a metric, or (R,) values of a metric for R resampled datasets."""


class SegmentedSample(Protocol):
    """Protocol of the segmentation samples that the evaluators accept: they have label ids and instance ids."""

    @property
    def label_ids(self) -> npt.NDArray[np.uint8]:
        """The (H, W) uint8 Cityscapes label ids of the picture."""
        ...

    @property
    def instance_ids(self) -> npt.NDArray[np.uint16]:
        """The (H, W) uint16 Cityscapes instance ids of the picture."""
        ...


class SemanticEvaluator:
    """Evaluator of semantic segmentation: gathers a confusion matrix of pixels, and the weighted counts of
    instances for iIoU.
    """

    def __init__(self) -> None:
        """Makes an evaluator without samples: all counts are 0."""
        self.confusion = np.zeros((COUNT, COUNT), dtype=np.int64)
        self.weighted_tp = np.zeros(COUNT)
        self.weighted_fn = np.zeros(COUNT)
        self.weighted_category_tp = np.zeros(COUNT)
        self.weighted_category_fn = np.zeros(COUNT)

    def update(self, sample: SegmentedSample, prediction: npt.NDArray[np.uint8]) -> Mapping[str, float]:
        """Adds the predicted (H, W) uint8 label ids of one sample; returns `miou` of this picture.

        Args:
            sample: a sample with its label ids and instance ids.
            prediction: (H, W) uint8 Cityscapes label ids.

        Raises:
            ValueError: the prediction has another shape than the ground truth, or holds a value that is no label id:
                not an integer, below 0 or above 33.
        """
        if prediction.shape != sample.label_ids.shape:
            raise ValueError(f"prediction must have shape {sample.label_ids.shape}, got {prediction.shape}")
        if prediction.dtype.kind not in "biu":
            raise ValueError(f"prediction must hold label ids as whole numbers, got {prediction.dtype}")
        for extreme in (prediction.min(), prediction.max()) if prediction.size else ():
            if not 0 <= extreme < COUNT:
                raise ValueError(f"prediction must hold label ids 0..{COUNT - 1}, got {extreme}")
        confusion = _confusion(sample.label_ids.reshape(-1), prediction.reshape(-1))
        self.confusion += confusion
        self._weigh(sample.instance_ids, prediction)
        return {"miou": float(mean_known(self._classes(confusion)))}

    def _weigh(self, instances: npt.NDArray[np.uint16], prediction: npt.NDArray[np.uint8]) -> None:
        chosen = instances >= INSTANCE_FACTOR
        ids, predicted = instances[chosen].astype(np.intp), prediction[chosen]
        ids *= COUNT
        ids += predicted
        counts = np.bincount(ids)
        table = np.zeros((-(-len(counts) // COUNT), COUNT), dtype=np.int64)
        table.reshape(-1)[: len(counts)] = counts
        for value in np.flatnonzero(table.any(axis=1)):
            label = LABELS[value // INSTANCE_FACTOR]
            if not label.is_evaluated:
                continue
            row = table[value]
            size = int(row.sum())
            weight = AVERAGE_INSTANCE_PX[label.name] / size
            hit = int(row[label.id])
            near = int(row[_ids(label.category, LABELS)].sum())
            self.weighted_tp[label.id] += hit * weight
            self.weighted_fn[label.id] += (size - hit) * weight
            self.weighted_category_tp[label.id] += near * weight
            self.weighted_category_fn[label.id] += (size - near) * weight

    def merge(self, other: Any) -> None:
        """Adds the counts that another evaluator of this class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        self.confusion += other.confusion
        self.weighted_tp += other.weighted_tp
        self.weighted_fn += other.weighted_fn
        self.weighted_category_tp += other.weighted_category_tp
        self.weighted_category_fn += other.weighted_category_fn

    def result(self) -> Mapping[str, float]:
        """The metrics by name: `miou`, `iiou`, `category_miou`, `category_iiou`, `pixel_accuracy`, and
        `iou_<class>`; shares, 0..1.
        """
        return {name: float(value) for name, value in self.metrics(self.totals()).items()}

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric: 0 and 1, because every metric of this evaluator is a
        share.

        Args:
            metric: name of the metric.
        """
        return 0.0, 1.0

    def lower_is_better(self, metric: str) -> bool | None:
        """False: every metric is a share of what is right.

        Args:
            metric: name of the metric.
        """
        return False

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """The gathered counts by name: the (COUNT, COUNT) confusion matrix of pixels, and (COUNT,) weighted counts
        of instances; COUNT is the number of label ids.
        """
        return {
            "confusion": self.confusion,
            "tp": self.weighted_tp,
            "fn": self.weighted_fn,
            "category_tp": self.weighted_category_tp,
            "category_fn": self.weighted_category_fn,
        }

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> dict[str, Values]:
        """Computes the metrics of `result` from counts by name. Further leading axes of the counts, such as
        resampled datasets, are kept.

        Args:
            totals: counts by name, as `totals` gives them.

        Returns:
            By name of the metric: a scalar, or one value per resampled dataset; NaN where the metric is undefined.
        """
        confusion = totals["confusion"]
        classes = self._classes(confusion)
        metrics = {
            "miou": mean_known(classes),
            "iiou": mean_known(_instance_iou(confusion, totals["tp"], totals["fn"])),
            "category_miou": mean_known(_category_iou(confusion)),
            "category_iiou": mean_known(
                _category_instance_iou(confusion, totals["category_tp"], totals["category_fn"])
            ),
            "pixel_accuracy": _accuracy(confusion),
        }
        return metrics | by_class(classes)

    def _classes(self, confusion: npt.NDArray[Any]) -> dict[str, Values]:
        """IoU by name of the classes over which the mean is taken, for one picture or for all."""
        return _class_iou(confusion)


class PresentClasses(SemanticEvaluator):
    """Evaluator of the mIoU over the classes that occur in the ground truth, without the class train.

    Cityscapes counts the IoU of a class that is predicted but does not occur as 0. Here the IoU of such a class is NaN
    and is left out of the mean; its pixels still count as errors of the classes to which they belong.
    """

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> dict[str, Values]:
        """Computes `miou` and `iou_<class>`, 0..1, from counts by name; NaN for classes that do not occur in the
        ground truth.

        Args:
            totals: counts by name, as `totals` gives them.
        """
        classes = self._classes(totals["confusion"])
        return {"miou": mean_known(classes)} | by_class(classes)

    def _classes(self, confusion: npt.NDArray[Any]) -> dict[str, Values]:
        """IoU by name of the classes over which the mean is taken; NaN for classes that do not occur."""
        occurs = confusion.sum(axis=-1) > 0
        return {
            label.name: np.where(occurs[..., label.id], iou, np.nan)
            for label, iou in zip(EVALUATED, _class_iou(confusion).values(), strict=True)
            if label.name != "train"
        }


def by_class(classes: Mapping[str, Values]) -> dict[str, Values]:
    """Returns the metrics `iou_<class>`, such as `iou_traffic_sign`.

    Args:
        classes: IoU by name of the class.
    """
    return {f"iou_{name.replace(' ', '_')}": iou for name, iou in classes.items()}


def _ids(category: str, among: Sequence[CityscapesLabel] = EVALUATED) -> list[int]:
    return [label.id for label in among if label.category == category]


def _block(confusion: npt.NDArray[Any], rows: Sequence[int], columns: Sequence[int]) -> Values:
    """(...,) number of pixels whose ground truth is one of `rows` and whose prediction is one of `columns`."""
    return np.asarray(confusion[..., np.array(rows)[:, None], np.array(columns)].sum(axis=(-2, -1)), np.float64)


def _false_positives(confusion: npt.NDArray[Any], ids: Sequence[int]) -> Values:
    """Number of pixels that are predicted as one of `ids` and whose ground truth is another, evaluated label."""
    return _block(confusion, [label.id for label in EVALUATED if label.id not in ids], ids)


def _confusion(truth: npt.NDArray[np.uint8], prediction: npt.NDArray[np.uint8]) -> npt.NDArray[np.int64]:
    """(COUNT, COUNT) confusion matrix of (N,) true and predicted labels, computed piece by piece so that a piece stays
    in the processor's cache.
    """
    counts = np.zeros(COUNT * COUNT, dtype=np.int64)
    for start in range(0, truth.size, PIECE_PX):
        pairs = truth[start : start + PIECE_PX].astype(np.intp)
        pairs *= COUNT
        pairs += prediction[start : start + PIECE_PX]
        counts += np.bincount(pairs, minlength=COUNT * COUNT)
    return counts.reshape(COUNT, COUNT)


def _class_iou(confusion: npt.NDArray[Any]) -> dict[str, Values]:
    return {label.name: _iou(confusion, [label.id]) for label in EVALUATED}


def _category_iou(confusion: npt.NDArray[Any]) -> dict[str, Values]:
    return {category: _iou(confusion, _ids(category)) for category in CATEGORIES}


def _iou(confusion: npt.NDArray[Any], ids: Sequence[int]) -> Values:
    tp = _block(confusion, ids, ids)
    fn = _block(confusion, ids, range(COUNT)) - tp
    return quotient(tp, tp + fn + _false_positives(confusion, ids))


def _instance_iou(confusion: npt.NDArray[Any], tp: Values, fn: Values) -> dict[str, Values]:
    return {
        label.name: quotient(
            tp[..., label.id], tp[..., label.id] + fn[..., label.id] + _false_positives(confusion, [label.id])
        )
        for label in EVALUATED
        if label.has_instances
    }


def _category_instance_iou(confusion: npt.NDArray[Any], tp: Values, fn: Values) -> dict[str, Values]:
    metrics = {}
    for category in CATEGORIES:
        # Here, unlike elsewhere, the benchmark's script takes a caravan or a trailer for a vehicle that was found.
        ids = _ids(category, LABELS)
        if all(LABELS[i].has_instances for i in ids):
            hit, missed = tp[..., ids].sum(axis=-1), fn[..., ids].sum(axis=-1)
            metrics[category] = quotient(hit, hit + missed + _false_positives(confusion, ids))
    return metrics


def _accuracy(confusion: npt.NDArray[Any]) -> Values:
    counted = [label.id for label in EVALUATED]
    right = np.diagonal(confusion, axis1=-2, axis2=-1)[..., counted].sum(axis=-1)
    return quotient(right, confusion[..., counted, :].sum(axis=(-2, -1)))


def quotient(part: npt.NDArray[Any], whole: npt.NDArray[Any]) -> Values:
    """Divides two arrays of numbers of pixels; NaN where the divisor is 0.

    Args:
        part: dividend.
        whole: divisor, of the same shape.
    """
    return np.asarray(np.divide(part, np.where(whole, whole, np.nan)), np.float64)


def mean_known(values: Mapping[str, Values]) -> Values:
    """Returns the mean of the values that are not NaN; NaN if all are.

    Args:
        values: values by name, each a scalar or one value per resampled dataset.
    """
    every = np.stack(list(values.values()))
    known = ~np.isnan(every)
    return quotient(np.where(known, every, 0).sum(axis=0), known.sum(axis=0))
