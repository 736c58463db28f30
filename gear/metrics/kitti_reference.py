"""The metric with which gear compares its reference networks of stereo detection: average precision of the
footprints of near cars.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gear.contracts.evaluation import Draws, Spread
from gear.formats.kitti_object import KittiLabel
from gear.metrics.kitti_ap import STEPS, KittiEvaluator, SampleT, curves, perfect_curve, resampled_r40
from gear.metrics.kitti_match import DIFFICULTIES, Chosen, Difficulty, PictureBoxes, choose, count
from gear.metrics.single_picture import SURE

MAX_DISTANCE_M = 40.0
MIN_OVERLAP = 0.5


class NearCars(KittiEvaluator[SampleT]):
    """Evaluator of the average precision of cars' footprints, at an overlap of 0.5.

    Labels and detections more than 40 m ahead are ignored. All other rules, including the difficulties, are the
    devkit's.
    """

    def update(self, sample: SampleT, prediction: Sequence[KittiLabel]) -> Mapping[str, float]:
        """Adds one sample with its detections; returns `found_share` and `false_alarms` of the footprints of near
        cars in this sample.

        `found_share` is the share of the labels that were detected, `false_alarms` the number of wrong detections; for
        moderate difficulty, and detections with a score of at least 0.5.

        Args:
            sample: a sample that `labels_of` can convert.
            prediction: the detections in its left picture, each with a score.

        Raises:
            ValueError: a detection has no score, a type that is none of KITTI's, a box whose right is left of its left
                or bottom above its top, or a number that is not finite.
        """
        super().update(sample, prediction)
        here = count(_near(self.pictures[-1], _moderate_first()[0]), np.array([SURE]))
        hits, wanted = float(here.tp[0]), float(here.tp[0] + here.fn[0])
        return {"found_share": hits / wanted if wanted else float("nan"), "false_alarms": float(here.fp[0])}

    def result(self) -> Mapping[str, float]:
        """The metrics `car_bev_<moderate|easy|hard>_r40`, average precision at 40 recalls, 0..1; NaN where no
        label counts.
        """
        metrics = {}
        for difficulty in _moderate_first():
            precision, _ = curves(self._chosen(difficulty))
            metrics[_name(difficulty)] = float(precision[1 : STEPS + 1].mean())
        return metrics

    def resampled(self, draws: Draws) -> Spread:
        """The metrics of `result` for R resampled datasets, from which confidence intervals are computed.

        Args:
            draws: (R, N) sample indices in the order of the calls of `update`; row r lists the samples of dataset r.

        Returns:
            (R,) values by name of the metric; NaN where no label counts.
        """
        return {_name(one): resampled_r40(self._chosen(one), draws) for one in _moderate_first()}

    def ceilings(self) -> Mapping[str, float]:
        """The values that perfect detections would reach, by name of the metric; only metrics whose value would be
        below 1.
        """
        curves_by_name = {_name(one): perfect_curve(self._chosen(one)) for one in _moderate_first()}
        most = {name: float(curve[1 : STEPS + 1].mean()) for name, curve in curves_by_name.items()}
        return {name: value for name, value in most.items() if value < 1}

    def _chosen(self, difficulty: Difficulty) -> list[Chosen]:
        return [_near(picture, difficulty) for picture in self.pictures]


def _near(picture: PictureBoxes, difficulty: Difficulty) -> Chosen:
    return choose(picture, "Car", difficulty, "bev", min_overlap=MIN_OVERLAP, max_distance_m=MAX_DISTANCE_M)


def _name(difficulty: Difficulty) -> str:
    return f"car_bev_{difficulty.name}_r40"


def _moderate_first() -> list[Difficulty]:
    return sorted(DIFFICULTIES, key=lambda difficulty: difficulty.name != "moderate")
