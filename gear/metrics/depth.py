"""Monocular depth: the figures of KITTI's devkit and the customary ones of Eigen et al.; means over pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array

Crop = Literal["none", "garg", "eigen"]

CROPS: dict[str, tuple[float, float, float, float]] = {
    "none": (0.0, 1.0, 0.0, 1.0),
    "garg": (0.40810811, 0.99189189, 0.03594771, 0.96405229),
    "eigen": (0.3324324, 0.91351351, 0.0359477, 0.96405229),
}
"""First and last row and column as shares of the picture."""

MIN_DEPTH_M = 1e-3


class DepthTruth(Protocol):
    """What the metric looks at."""

    @property
    def depth_m(self) -> FloatImage:
        """(H, W) float32 metres, NaN where there is no ground truth."""
        ...


class DepthEvaluator:
    """Gathers the figures of every picture.

    Plain names are the devkit's, over every pixel with ground truth; `eigen_` names look at ground truth between 1 mm
    and `max_depth_m` inside the crop, with predictions clipped to the same range.
    """

    def __init__(self, *, max_depth_m: float = 80.0, crop: Crop = "none") -> None:
        self.max_depth_m = max_depth_m
        self.crop = crop
        self.figures: dict[str, list[float]] = {}

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Takes (H, W) metres; returns this picture's figures.

        Raises:
            ValueError: the prediction has another shape, or is not positive and finite where there is ground truth.
        """
        truth_m = sample.depth_m
        if prediction.shape != truth_m.shape:
            raise ValueError(f"prediction must have shape {truth_m.shape}, got {prediction.shape}")
        known = np.isfinite(truth_m)
        if not np.isfinite(prediction[known]).all() or (prediction[known] <= 0).any():
            raise ValueError("prediction must be positive and finite wherever there is ground truth")
        looked_at = known & self._window(truth_m.shape) & (truth_m > MIN_DEPTH_M) & (truth_m < self.max_depth_m)
        clipped = np.clip(prediction[looked_at].astype(np.float64), MIN_DEPTH_M, self.max_depth_m)
        found = self._everywhere(truth_m[known], prediction[known])
        found |= _eigen(truth_m[looked_at].astype(np.float64), clipped)
        for name, value in found.items():
            self.figures.setdefault(name, []).append(value)
        return found

    def _everywhere(self, truth_m: FloatImage, found_m: FloatImage) -> dict[str, float]:
        """The devkit's figures of every pixel with ground truth."""
        return _devkit(truth_m.astype(np.float64), found_m.astype(np.float64))

    def _window(self, shape: tuple[int, ...]) -> np.ndarray:
        height, width = shape[0], shape[1]
        top, bottom, left, right = CROPS[self.crop]
        window = np.zeros((height, width), dtype=np.bool_)
        window[int(top * height) : int(bottom * height), int(left * width) : int(right * width)] = True
        return window

    def merge(self, other: Any) -> None:
        """Takes in the pictures of another one."""
        for name, values in other.figures.items():
            self.figures.setdefault(name, []).extend(values)

    def result(self) -> Mapping[str, float]:
        """Means over pictures that have ground truth.

        `mae_m`, `rmse_m`, `imae_per_km`, `irmse_per_km`, `log_mae`, `log_rmse`, `silog` (x100), `abs_rel`, `sq_rel`
        (squared error over squared depth); `eigen_d1` to `eigen_d3`, `eigen_abs_rel`, `eigen_sq_rel` (over depth),
        `eigen_rmse_m`, `eigen_rmse_log`, `eigen_log10`, `eigen_silog`.
        """
        names = (*_devkit(np.ones(1), np.ones(1)), *_eigen(np.ones(1), np.ones(1)))
        known = {name: [v for v in self.figures.get(name, []) if v == v] for name in names}
        # Sorted, so that the order in which pictures came does not reach the last digit.
        return {name: float(np.mean(np.sort(values))) if values else float("nan") for name, values in known.items()}


class NearDepth(DepthEvaluator):
    """What a reference network is held to: whole pictures below 80 m, predictions clipped there; no sky."""

    def __init__(self) -> None:
        super().__init__(max_depth_m=80.0, crop="none")

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Takes (H, W) metres; returns this picture's figures."""
        return _renamed(super().update(sample, prediction))

    def result(self) -> Mapping[str, float]:
        """`d1`, `rmse_m`, `d2`, `d3`, `abs_rel`, `sq_rel`, `rmse_log`, `log10`, `silog`: means over pictures."""
        return _renamed(super().result())

    def _everywhere(self, truth_m: FloatImage, found_m: FloatImage) -> dict[str, float]:
        """None: the devkit's figures are not shown."""
        return {}


def _renamed(figures: Mapping[str, float]) -> dict[str, float]:
    """Eigen's figures without their prefix."""
    prefix = "eigen_"
    plain = {name.removeprefix(prefix): value for name, value in figures.items() if name.startswith(prefix)}
    first = {name: plain[name] for name in ("d1", "rmse_m")}
    return first | plain


def _devkit(truth_m: Array, found_m: Array) -> dict[str, float]:
    error, inverse, log = found_m - truth_m, 1 / truth_m - 1 / found_m, np.log(truth_m) - np.log(found_m)
    relative, log_square = error / truth_m, _mean(log**2)
    return {
        "mae_m": _mean(np.abs(error)),
        "rmse_m": _root(_mean(error**2)),
        "imae_per_km": 1000 * _mean(np.abs(inverse)),
        "irmse_per_km": 1000 * _root(_mean(inverse**2)),
        "log_mae": _mean(np.abs(log)),
        "log_rmse": _root(log_square),
        "silog": 100 * _root(log_square - _mean(log) ** 2),
        "abs_rel": _mean(np.abs(relative)),
        "sq_rel": _mean(relative**2),
    }


def _eigen(truth_m: Array, found_m: Array) -> dict[str, float]:
    ratio = np.maximum(truth_m / found_m, found_m / truth_m)
    error, log = truth_m - found_m, np.log(found_m) - np.log(truth_m)
    square, log_square = error**2, _mean(log**2)
    return {
        "eigen_d1": _share(ratio < 1.25),
        "eigen_d2": _share(ratio < 1.25**2),
        "eigen_d3": _share(ratio < 1.25**3),
        "eigen_abs_rel": _mean(np.abs(error) / truth_m),
        "eigen_sq_rel": _mean(square / truth_m),
        "eigen_rmse_m": _root(_mean(square)),
        "eigen_rmse_log": _root(log_square),
        "eigen_log10": _mean(np.abs(log)) / math.log(10),
        "eigen_silog": _root(log_square - 0.5 * _mean(log) ** 2),
    }


def _share(truths: npt.NDArray[np.bool_]) -> float:
    return np.count_nonzero(truths) / truths.size if truths.size else float("nan")


def _mean(values: Array) -> float:
    return float(values.mean()) if values.size else float("nan")


def _root(value: float) -> float:
    return float(np.sqrt(max(value, 0.0))) if value == value else value
