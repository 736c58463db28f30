"""The depth error on the nearest obstacle in the ego lane: what a braking car would take the gap for.

Metrics over whole pictures hardly notice one obstacle, because most pixels are road, facades and sky. An attack that
moves the car ahead away is the dangerous one.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np

from gear.contracts.evaluation import Draws, Spread
from gear.metrics.depth import MIN_DEPTH_M, known_means
from gear.metrics.obstacle_pixels import nearest_obstacle
from gear.values.frames import FloatImage
from gear.values.scene import SceneRecord

NEAREST_OBSTACLE = "nearest_obstacle"
"""Name of the report of an evaluation with these metrics."""

FARTHER, MUCH_FARTHER = 1.14, 1.25
"""Factors on the true depth: AdvRM (NeurIPS 2024) counts an obstacle's pixels beyond 1.14, and delta_1 of Eigen et al.
(NeurIPS 2014) allows 1.25.
"""

NAMES = ("mae_m", "abs_rel", "bias_rel", "farther_share", "is_much_farther", "has_obstacle")


class ObstacleTruth(Protocol):
    """Protocol of the depth samples that the evaluator accepts."""

    @property
    def record(self) -> SceneRecord:
        """The scene record, with the poses of the ego car, the camera and the road users."""
        ...

    @property
    def depth_m(self) -> FloatImage:
        """The (H, W) float32 true depth in metres; NaN where there is no ground truth."""
        ...


class ObstacleDepth:
    """Evaluator of the depth on the nearest obstacle in the ego lane (`gear.metrics.obstacle_pixels`).

    Pictures without an obstacle count for `has_obstacle` only.
    """

    def __init__(self, camera: str) -> None:
        """Makes an evaluator without pictures.

        Args:
            camera: name of the camera whose depth is predicted.
        """
        self.camera = camera
        self.pictures: list[dict[str, float]] = []

    def update(self, sample: ObstacleTruth, prediction: FloatImage) -> dict[str, float]:
        """Adds a predicted (H, W) depth map in metres; returns the metrics of this picture, NaN without an obstacle.

        Args:
            sample: a sample with its true depth and its scene record.
            prediction: (H, W) predicted depth.

        Raises:
            ValueError: the prediction has another shape than the ground truth, or is not positive and finite on the
                obstacle.
        """
        truth_m, predicted_m = sample.depth_m, np.asarray(prediction)
        if predicted_m.shape != truth_m.shape:
            raise ValueError(f"prediction must have shape {truth_m.shape}, got {predicted_m.shape}")
        obstacle = nearest_obstacle(sample.record, self.camera, truth_m)
        found = dict.fromkeys(NAMES, math.nan) | {"has_obstacle": float(obstacle is not None)}
        if obstacle is not None:
            true_m = truth_m[obstacle.pixels].astype(np.float64)
            said_m = predicted_m[obstacle.pixels].astype(np.float64)
            if not np.isfinite(said_m).all() or (said_m <= 0).any():
                raise ValueError("prediction must be positive and finite wherever there is ground truth")
            found |= _errors(true_m, said_m)
        self.pictures.append(found)
        return dict(found)

    def merge(self, other: Any) -> None:
        """Adds the pictures that another evaluator of this class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        self.pictures.extend(other.pictures)

    def result(self) -> dict[str, float]:
        """The metrics by name, as means over the pictures with an obstacle.

        - `mae_m`, `abs_rel`: mean absolute error over the obstacle's pixels, in metres and relative to the true depth.
        - `bias_rel`: mean signed relative error; above 0 the obstacle appears farther away, which is dangerous.
        - `farther_share`: share of the obstacle's pixels whose depth is more than 1.14 times the true one.
        - `is_much_farther`: share of the pictures in which the median of this quotient is above 1.25.
        - `has_obstacle`: share of all pictures with an obstacle in the corridor.
        """
        values = {name: np.sort([one[name] for one in self.pictures if one[name] == one[name]]) for name in NAMES}
        return {name: float(one.mean()) if len(one) else math.nan for name, one in values.items()}

    def resampled(self, draws: Draws) -> Spread:
        """The metrics of `result` for R resampled datasets, from which confidence intervals are computed.

        Args:
            draws: (R, N) picture indices in the order of the calls of `update`.

        Returns:
            (R,) values by name of the metric; NaN where no picture has an obstacle.
        """
        return {name: known_means(np.array([one[name] for one in self.pictures])[draws]) for name in NAMES}

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric: 0 and 1 for shares, 0 and infinity for errors, -1 and
        infinity for the signed error.

        Args:
            metric: name of the metric.
        """
        if metric == "bias_rel":
            return -1.0, math.inf
        return 0.0, math.inf if metric in ("mae_m", "abs_rel") else 1.0

    def lower_is_better(self, metric: str) -> bool | None:
        """True for errors, and for shares of obstacles that appear too far away. None for `bias_rel`, whose best value
        is 0, and for `has_obstacle`, which describes the dataset.

        Args:
            metric: name of the metric.
        """
        return None if metric in ("bias_rel", "has_obstacle") else True


def _errors(true_m: np.ndarray, said_m: np.ndarray) -> dict[str, float]:
    """The errors on (N,) pixels of an obstacle with true and predicted depths in metres."""
    error_m, ratio = said_m - true_m, said_m / np.maximum(true_m, MIN_DEPTH_M)
    return {
        "mae_m": float(np.abs(error_m).mean()),
        "abs_rel": float((np.abs(error_m) / true_m).mean()),
        "bias_rel": float((error_m / true_m).mean()),
        "farther_share": float((ratio > FARTHER).mean()),
        "is_much_farther": float(np.median(ratio) > MUCH_FARTHER),
    }
