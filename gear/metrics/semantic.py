"""Semantic segmentation by the definitions of Cityscapes: IoU of classes and categories, and iIoU.

Pixels whose ground truth is not evaluated count nowhere. A class that occurs neither in ground truth nor in
predictions is left out of the mean. For iIoU every pixel of an instance weighs the class's average instance size over
that instance's size.
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
"""Average size of an instance in the benchmark's training set."""

EVALUATED = tuple(label for label in LABELS if label.is_evaluated)
CATEGORIES = tuple(dict.fromkeys(label.category for label in EVALUATED))
COUNT = len(LABELS)

PIECE_PX = 1 << 17


class SegmentedSample(Protocol):
    """What the metric looks at."""

    @property
    def label_ids(self) -> npt.NDArray[np.uint8]:
        """(H, W) uint8 label ids."""
        ...

    @property
    def instance_ids(self) -> npt.NDArray[np.uint16]:
        """(H, W) uint16 instance ids."""
        ...


class SemanticEvaluator:
    """Gathers one confusion matrix and the weighted counts of instances."""

    def __init__(self) -> None:
        self.confusion = np.zeros((COUNT, COUNT), dtype=np.int64)
        self.weighted_tp = np.zeros(COUNT)
        self.weighted_fn = np.zeros(COUNT)
        self.weighted_category_tp = np.zeros(COUNT)
        self.weighted_category_fn = np.zeros(COUNT)

    def update(self, sample: SegmentedSample, prediction: npt.NDArray[np.uint8]) -> Mapping[str, float]:
        """Takes (H, W) uint8 label ids; returns `miou` of this picture.

        Raises:
            ValueError: the prediction has another shape or holds ids above 33.
        """
        if prediction.shape != sample.label_ids.shape:
            raise ValueError(f"prediction must have shape {sample.label_ids.shape}, got {prediction.shape}")
        if prediction.size and prediction.max() >= COUNT:
            raise ValueError(f"prediction must hold label ids 0..{COUNT - 1}, got {prediction.max()}")
        confusion = _confusion(sample.label_ids.reshape(-1), prediction.reshape(-1))
        self.confusion += confusion
        self._weigh(sample.instance_ids, prediction)
        return {"miou": _mean(self._classes(confusion).values())}

    def _classes(self, confusion: npt.NDArray[np.int64]) -> dict[str, float]:
        """IoU by name of the classes that the mean is over, of one picture or of all."""
        return _class_iou(confusion)

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
        """Adds the counts of another one."""
        self.confusion += other.confusion
        self.weighted_tp += other.weighted_tp
        self.weighted_fn += other.weighted_fn
        self.weighted_category_tp += other.weighted_category_tp
        self.weighted_category_fn += other.weighted_category_fn

    def result(self) -> Mapping[str, float]:
        """`miou`, `iiou`, `category_miou`, `category_iiou`, `pixel_accuracy`, and `iou_<class>`; shares, 0..1."""
        classes = self._classes(self.confusion)
        figures = {
            "miou": _mean(classes.values()),
            "iiou": _mean(self._instance_iou().values()),
            "category_miou": _mean(self._category_iou().values()),
            "category_iiou": _mean(self._category_instance_iou().values()),
            "pixel_accuracy": self._accuracy(),
        }
        return figures | {f"iou_{name.replace(' ', '_')}": value for name, value in classes.items()}

    def _accuracy(self) -> float:
        counted = [label.id for label in EVALUATED]
        total = self.confusion[counted].sum()
        return float(sum(self.confusion[i, i] for i in counted) / total) if total else float("nan")

    def _instance_iou(self) -> dict[str, float]:
        figures = {}
        for label in EVALUATED:
            if label.has_instances:
                tp, fn = self.weighted_tp[label.id], self.weighted_fn[label.id]
                figures[label.name] = _share(tp, tp + fn + _false_positives(self.confusion, [label.id]))
        return figures

    def _category_iou(self) -> dict[str, float]:
        figures = {}
        for category in CATEGORIES:
            ids = _ids(category)
            tp = float(self.confusion[np.ix_(ids, ids)].sum())
            fn = float(self.confusion[ids].sum()) - tp
            figures[category] = _share(tp, tp + fn + _false_positives(self.confusion, ids))
        return figures

    def _category_instance_iou(self) -> dict[str, float]:
        figures = {}
        for category in CATEGORIES:
            # Here, unlike elsewhere, the benchmark's script takes a caravan or a trailer for a vehicle that was found.
            ids = _ids(category, LABELS)
            if all(LABELS[i].has_instances for i in ids):
                tp, fn = self.weighted_category_tp[ids].sum(), self.weighted_category_fn[ids].sum()
                figures[category] = _share(tp, tp + fn + _false_positives(self.confusion, ids))
        return figures


class PresentClasses(SemanticEvaluator):
    """mIoU over the evaluated classes that occur in the ground truth, train left out.

    The benchmark counts a class that is predicted but never there as 0; here such pixels count against the classes
    that they belong to, and the class itself is NaN: absent.
    """

    def result(self) -> Mapping[str, float]:
        """`miou` and `iou_<class>`; shares, 0..1, NaN for what does not occur."""
        classes = self._classes(self.confusion)
        return {"miou": _mean(classes.values())} | {f"iou_{n.replace(' ', '_')}": iou for n, iou in classes.items()}

    def _classes(self, confusion: npt.NDArray[np.int64]) -> dict[str, float]:
        """NaN for what does not occur."""
        return {
            label.name: iou if confusion[label.id].any() else float("nan")
            for label, iou in zip(EVALUATED, _class_iou(confusion).values(), strict=True)
            if label.name != "train"
        }


def _ids(category: str, among: Sequence[CityscapesLabel] = EVALUATED) -> list[int]:
    return [label.id for label in among if label.category == category]


def _false_positives(confusion: npt.NDArray[np.int64], ids: list[int]) -> float:
    """Pixels predicted as one of `ids` whose ground truth is evaluated and another."""
    others = [label.id for label in EVALUATED if label.id not in ids]
    return float(confusion[np.ix_(others, ids)].sum())


def _confusion(truth: npt.NDArray[np.uint8], prediction: npt.NDArray[np.uint8]) -> npt.NDArray[np.int64]:
    """(COUNT, COUNT) pixels by label of the ground truth and of the prediction, both (N,); a piece at a time, so that
    it stays in the cache."""
    counts = np.zeros(COUNT * COUNT, dtype=np.int64)
    for start in range(0, truth.size, PIECE_PX):
        pairs = truth[start : start + PIECE_PX].astype(np.intp)
        pairs *= COUNT
        pairs += prediction[start : start + PIECE_PX]
        counts += np.bincount(pairs, minlength=COUNT * COUNT)
    return counts.reshape(COUNT, COUNT)


def _class_iou(confusion: npt.NDArray[np.int64]) -> dict[str, float]:
    figures = {}
    for label in EVALUATED:
        tp = float(confusion[label.id, label.id])
        fn = float(confusion[label.id].sum()) - tp
        figures[label.name] = _share(tp, tp + fn + _false_positives(confusion, [label.id]))
    return figures


def _share(part: float, whole: float) -> float:
    return float(part / whole) if whole else float("nan")


def _mean(values: Any) -> float:
    known = [value for value in values if value == value]
    return float(np.mean(known)) if known else float("nan")
