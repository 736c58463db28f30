"""The report `objects`: how many objects were found or missed, and false alarms on the patch and elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Spread, WithObjects
from gear.contracts.tasks import Sample
from gear.measuring.patch_area import patch_masks
from gear.metrics.object_matching import outcomes
from gear.metrics.patch_distance import PatchArea
from gear.values.geometry import Array
from gear.values.picture_objects import ObjectState, PictureOutcomes
from gear.values.scene import Vec3

OBJECTS = "objects"
"""Name of the report on objects."""

ALARM_METRICS = ("false_alarms_on_patch", "false_alarms_elsewhere")
"""Metrics that are numbers of false alarms per picture."""

STATES: tuple[ObjectState, ...] = ("found", "missed", "misclassified", "moved")

STATE_METRICS = {f"{state}_share": state for state in STATES}
"""Metrics that are shares of the objects in one state: state by name of the metric."""


class ObjectEvaluator:
    """An evaluator that counts, for each picture, found and missed objects and false alarms."""

    def __init__(self, task: WithObjects) -> None:
        """Prepares an evaluator without pictures.

        Args:
            task: task of the samples, which provides the objects and detections of each picture.
        """
        self._task = task
        self.pictures: list[PictureOutcomes] = []

    def update(self, sample: Sample, prediction: Any) -> Mapping[str, float]:
        """Adds one sample; returns the metrics of this sample alone, with the names of `result`.

        Args:
            sample: the sample with its ground truth.
            prediction: the task's prediction for it.
        """
        given = self._task.picture_objects(sample, prediction)
        middles_m = [
            _middle_m(surface.camera_from_surface)
            for surface in sample.surfaces
            if surface.camera == given.camera and surface.visible_px
        ]
        area = PatchArea(patch_masks(sample)[given.camera], middles_m)
        self.pictures.append(outcomes(given, area))
        return _values(_counts(self.pictures[-1]))

    def merge(self, other: Any) -> None:
        """Adds the pictures that the evaluator `other` has gathered, after those of this one."""
        self.pictures += other.pictures

    def result(self) -> Mapping[str, float]:
        """The metrics over all gathered pictures, by name.

        The metrics are the false alarms per picture on the patch and elsewhere, and the share of the objects in each
        state (`found`, `missed`, `misclassified`, `moved`). A metric is NaN if there are no pictures or no objects.
        """
        return _values(self.totals()["counts"])

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """The sums over all gathered pictures, as one (7,) float64 array under the key `counts`.

        Its entries are the numbers of pictures, false alarms on the patch, false alarms elsewhere, and objects that are
        found, missed, misclassified and moved.
        """
        return {"counts": np.sum([_counts(one) for one in self.pictures], axis=0) if self.pictures else np.zeros(7)}

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> Spread:
        """Computes the metrics from R sets of sums over pictures; returns (R,) values by name of the metric.

        Args:
            totals: (R, 7) array `counts`. Its columns are the numbers of pictures, false alarms on the patch, false
                alarms elsewhere, and objects that are found, missed, misclassified and moved.
        """
        rows = [_values(row) for row in totals["counts"]]
        return {name: np.array([row[name] for row in rows]) for name in (*ALARM_METRICS, *STATE_METRICS)}

    def range_of(self, metric: str) -> tuple[float, float]:
        """The smallest and largest possible value of a metric: 0 and 1 for shares, 0 and infinity for false alarms
        per picture.
        """
        return 0.0, 1.0 if metric in STATE_METRICS else math.inf

    def lower_is_better(self, metric: str) -> bool | None:
        """False for the share of found objects; True for shares of all other states, and for false alarms.

        Args:
            metric: name of the metric.
        """
        return metric != "found_share"

    def counted(self) -> frozenset[str]:
        """The metrics that are numbers of events per picture: the false alarms."""
        return frozenset(ALARM_METRICS)


def _middle_m(camera_from_surface: tuple[float, ...]) -> Vec3:
    """Middle of a surface in the camera's frame, from its pose as 16 numbers."""
    return (camera_from_surface[3], camera_from_surface[7], camera_from_surface[11])


def _counts(picture: PictureOutcomes) -> Array:
    """The (7,) numbers of one picture.

    They are 1 (the picture), false alarms on the patch, false alarms elsewhere, and objects that are found, missed,
    misclassified and moved.
    """
    alarms = [one.patch.is_on_patch for one in picture.detections if one.is_false_alarm]
    states = [thing.state for thing in picture.objects]
    every = (1, sum(alarms), len(alarms) - sum(alarms), *(states.count(state) for state in STATE_METRICS.values()))
    return np.array(every, dtype=np.float64)


def _values(counts: Array) -> dict[str, float]:
    """The metrics by name, from (7,) sums."""
    pictures, on_patch, elsewhere, *states = (float(value) for value in counts)
    objects = sum(states)
    alarms = dict(zip(ALARM_METRICS, (on_patch, elsewhere), strict=True))
    found = {name: value / pictures if pictures else math.nan for name, value in alarms.items()}
    shares = zip(STATE_METRICS, states, strict=True)
    return found | {name: value / objects if objects else math.nan for name, value in shares}
