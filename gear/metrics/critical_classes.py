"""Metrics of semantic segmentation on the classes that matter to a driver: road users, traffic lights and signs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.metrics.semantic import (
    CATEGORIES,
    EVALUATED,
    SegmentedSample,
    SemanticEvaluator,
    Values,
    by_class,
    mean_known,
    quotient,
)

CRITICAL = "critical"
"""Name of the report of an evaluation with these metrics."""

OBJECTS = ("traffic light", "traffic sign")
CRITICAL_LABELS = tuple(label for label in EVALUATED if label.category in ("human", "vehicle") or label.name in OBJECTS)
IDS = [label.id for label in CRITICAL_LABELS]
OTHER_IDS = [label.id for label in EVALUATED if label.id not in IDS]
ROAD_IDS = [label.id for label in EVALUATED if label.category == CATEGORIES[0]]
"""Ids of the classes road and sidewalk, Cityscapes' category `flat`."""


class CriticalClasses(SemanticEvaluator):
    """Evaluator of the pixels of road users, traffic lights and signs.

    Most pixels of a street are road, facades and sky, so a mean over all classes or pixels hides that a patch removes
    a person.
    """

    def update(self, sample: SegmentedSample, prediction: npt.NDArray[np.uint8]) -> Mapping[str, float]:
        """Adds the predicted (H, W) uint8 label ids of one sample; returns `miou`, `found_share`, `as_road_share` and
        `invented_share` of this picture.

        Args:
            sample: a sample with its label ids and instance ids.
            prediction: (H, W) uint8 Cityscapes label ids.
        """
        before = self.confusion.copy()
        super().update(sample, prediction)
        return {name: float(value) for name, value in self._shares(self.confusion - before).items()}

    def lower_is_better(self, metric: str) -> bool | None:
        """True for `as_road_share` and `invented_share`, which are shares of errors; False for all other metrics.

        Args:
            metric: name of the metric.
        """
        return metric in ("as_road_share", "invented_share")

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> dict[str, Values]:
        """Computes the metrics, shares in 0..1, from counts by name; NaN where no pixel counts.

        - `miou`: mean IoU of the critical classes that occur in the ground truth, and `iou_<class>` of each.
        - `found_share`: share of the critical classes' pixels that are predicted as their class; 1 is best.
        - `as_road_share`: share of these pixels that are predicted as road or sidewalk, the dangerous error.
        - `invented_share`: share of all other evaluated pixels that are predicted as a critical class.

        Args:
            totals: counts by name, as `totals` gives them.
        """
        confusion = totals["confusion"]
        return self._shares(confusion) | by_class(self._classes(confusion))

    def _shares(self, confusion: npt.NDArray[Any]) -> dict[str, Values]:
        rows = confusion[..., IDS, :]
        whole = rows.sum(axis=(-2, -1))
        right = np.diagonal(confusion, axis1=-2, axis2=-1)[..., IDS].sum(axis=-1)
        others = confusion[..., OTHER_IDS, :]
        return {
            "miou": mean_known(self._classes(confusion)),
            "found_share": quotient(right, whole),
            "as_road_share": quotient(rows[..., ROAD_IDS].sum(axis=(-2, -1)), whole),
            "invented_share": quotient(others[..., IDS].sum(axis=(-2, -1)), others.sum(axis=(-2, -1))),
        }

    def _classes(self, confusion: npt.NDArray[Any]) -> dict[str, Values]:
        """IoU by name of the critical classes; NaN for classes that do not occur in the ground truth."""
        every = super()._classes(confusion)
        occurs = confusion.sum(axis=-1) > 0
        return {label.name: np.where(occurs[..., label.id], every[label.name], np.nan) for label in CRITICAL_LABELS}
