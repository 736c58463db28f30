"""What a reference network of stereo detection is held to: near cars, seen from above."""

from __future__ import annotations

from collections.abc import Mapping

from gear.contracts.evaluation import Draws, Spread
from gear.metrics.kitti_ap import STEPS, KittiEvaluator, SampleT, curves, perfect_curve, resampled_r40
from gear.metrics.kitti_match import DIFFICULTIES, Chosen, Difficulty, choose

MAX_DISTANCE_M = 40.0
MIN_OVERLAP = 0.5


class NearCars(KittiEvaluator[SampleT]):
    """Average precision of cars seen from above, at an overlap of 0.5.

    Labels and detections more than 40 m ahead are ignored. Everything else, the difficulties too, is the devkit's.
    """

    def result(self) -> Mapping[str, float]:
        """`car_bev_<moderate|easy|hard>_r40`, shares, 0..1; NaN where no label is to be found."""
        figures = {}
        for difficulty in _moderate_first():
            precision, _ = curves(self._chosen(difficulty))
            figures[_name(difficulty)] = float(precision[1 : STEPS + 1].mean())
        return figures

    def resampled(self, draws: Draws) -> Spread:
        """All of them."""
        return {_name(one): resampled_r40(self._chosen(one), draws) for one in _moderate_first()}

    def ceilings(self) -> Mapping[str, float]:
        """What perfect detections would come to, where that is less than 1."""
        curves_by_name = {_name(one): perfect_curve(self._chosen(one)) for one in _moderate_first()}
        most = {name: float(curve[1 : STEPS + 1].mean()) for name, curve in curves_by_name.items()}
        return {name: value for name, value in most.items() if value < 1}

    def _chosen(self, difficulty: Difficulty) -> list[Chosen]:
        return [
            choose(picture, "Car", difficulty, "bev", min_overlap=MIN_OVERLAP, max_distance_m=MAX_DISTANCE_M)
            for picture in self.pictures
        ]


def _name(difficulty: Difficulty) -> str:
    return f"car_bev_{difficulty.name}_r40"


def _moderate_first() -> list[Difficulty]:
    return sorted(DIFFICULTIES, key=lambda difficulty: difficulty.name != "moderate")
