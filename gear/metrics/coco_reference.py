"""The metric with which gear compares its reference networks of 2D detection: AP50 of the frequent traffic
categories of a dataset.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gear.contracts.evaluation import Draws, Spread
from gear.formats.coco import CATEGORY_NAMES, Detection, Picture
from gear.metrics.coco_ap import CocoEvaluator, SampleT
from gear.metrics.coco_curves import Matches, average_precision, known_mean, matches, resampled
from gear.values.serial import Json

CATEGORIES = ("person", "bicycle", "car", "motorcycle", "bus", "truck")
MIN_HEIGHT_PX = 32.0
AT_HEIGHT_PX = 800
"""Number of rows of the picture for which limits on heights of objects are stated; limits scale with the picture's
height.
"""

MIN_INSTANCES = 50
LARGE = 1e10


class TallObjects(CocoEvaluator[SampleT]):
    """Evaluator of average precision at IoU 0.5, averaged over the traffic categories with at least 50 instances.

    An instance counts if its visible box is at least 32 px high in a picture of 800 rows. Lower instances are ignored,
    and so are lower detections that match nothing, as pycocotools ignores objects outside an area range.
    """

    def result(self) -> Mapping[str, float]:
        """The metrics by name: `ap50`, `ap50_<category>` (NaN for fewer than 50 instances) and
        `instances_<category>`, the number of instances.
        """
        found = self._found()
        counts = {name: int(one.label_counts.sum()) if (one := found.get(name)) else 0 for name in CATEGORIES}
        values = {
            name: float(average_precision(found[name], np.ones(len(self.pictures), dtype=np.int64))[0])
            if counts[name] >= MIN_INSTANCES
            else float("nan")
            for name in CATEGORIES
        }
        total = float(known_mean(np.array(list(values.values())), (0,)))
        instances = {f"instances_{name}": float(count) if self.pictures else np.nan for name, count in counts.items()}
        return {"ap50": total, **{f"ap50_{name}": value for name, value in values.items()}, **instances}

    def lower_is_better(self, metric: str) -> bool | None:
        """False for average precision; None for `instances_<category>`, which describe the dataset.

        Args:
            metric: name of the metric.
        """
        return None if metric.startswith("instances_") else False

    def resampled(self, draws: Draws) -> Spread:
        """The metrics `ap50` and `ap50_<category>` of R resampled datasets, from which confidence intervals are
        computed. The categories with at least 50 instances in the whole dataset count.

        Args:
            draws: (R, N) sample indices in the order of the calls of `update`; row r lists the samples of dataset r.

        Returns:
            (R,) values by name of the metric.
        """
        found = {name: one for name, one in self._found().items() if int(one.label_counts.sum()) >= MIN_INSTANCES}
        values = resampled(list(found.values()), draws)[:, :, 0]
        return {"ap50": known_mean(values, (1,)), **{f"ap50_{name}": values[:, i] for i, name in enumerate(found)}}

    def _single(self, picture: Picture, found: Sequence[Detection]) -> dict[str, float]:
        """The metrics of a single picture, for the same categories and heights."""
        low_px = MIN_HEIGHT_PX * picture.height_px / AT_HEIGHT_PX
        labels = [
            replace(item, is_crowd=item.is_crowd or item.box_xywh[3] < low_px)
            for item in picture.annotations
            if CATEGORY_NAMES[item.category_id] in CATEGORIES
        ]
        counted = [one for one in found if CATEGORY_NAMES[one.category_id] in CATEGORIES]
        return self._metrics(replace(picture, annotations=tuple(labels)), counted, low_px)

    def _found(self) -> dict[str, Matches]:
        if not self.pictures:
            return {}
        by_category = matches(self._matched())
        return {
            CATEGORY_NAMES[number]: one for number, one in by_category.items() if CATEGORY_NAMES[number] in CATEGORIES
        }

    def _adapt(self, labels: list[Json], found: list[Json]) -> None:
        """Replaces the areas of objects by their heights."""
        for item in (*labels, *found):
            item["area"] = item["bbox"][3] * AT_HEIGHT_PX / self.pictures[item["image_id"]].height_px

    def _limit(self, parameters: Any) -> None:
        parameters.areaRng, parameters.areaRngLbl = [[MIN_HEIGHT_PX, LARGE]], ["tall"]
        parameters.iouThrs = np.array([0.5])
