"""Metrics of monocular depth, averaged over pictures: those of KITTI's devkit and those of Eigen et al. (NeurIPS
2014).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, Protocol, TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.evaluation import Draws, Spread
from gear.formats.kitti_depth import MAX_PNG_DEPTH_M, UNITS_PER_M
from gear.values.frames import FloatImage
from gear.values.geometry import Array

T = TypeVar("T")

Crop = Literal["none", "garg", "eigen"]

SHARES = ("d1", "d2", "d3")
"""Names of the shares of pixels with a small error, without the prefix `eigen_`."""

CROPS: dict[str, tuple[float, float, float, float]] = {
    "none": (0.0, 1.0, 0.0, 1.0),
    "garg": (0.40810811, 0.99189189, 0.03594771, 0.96405229),
    "eigen": (0.3324324, 0.91351351, 0.0359477, 0.96405229),
}
"""Evaluated part of the picture by name of the crop: first and last row, first and last column, as shares of the
picture's size.
"""

MIN_DEPTH_M = 1e-3

MIN_CODED_DEPTH_M = 1 / UNITS_PER_M
"""Smallest depth that the 16-bit pictures of KITTI's devkit can hold, in metres."""

PIXELS_AT_ONCE = 1 << 16
"""Number of pixels that are processed at a time; their intermediate results fit into the processor's cache."""

SINGLE_PRECISION_M = 1e5
"""Depths from the inverse of this value up to this value are processed in single precision, other depths in double
precision.
"""

LOG_ERROR = 1e-6
"""Upper bound on the error of the logarithm of a quotient in single precision; the actual error is at most a few
times 1e-7.
"""


class DepthTruth(Protocol):
    """Protocol of the depth samples that the evaluators accept: they have `depth_m`."""

    @property
    def depth_m(self) -> FloatImage:
        """The (H, W) float32 true depth in metres; NaN where there is no ground truth."""
        ...


class DepthEvaluator:
    """Evaluator of monocular depth: gathers the metrics of every picture and averages them.

    Metrics without a prefix are the metrics of KITTI's devkit. They count the pixels whose true depth fits into the
    devkit's 16-bit pictures (up to 256 m); predictions are clipped to the range of these pictures. Metrics with the
    prefix `eigen_` count the pixels inside the crop with a true depth between 1 mm and `max_depth_m`; predictions are
    clipped to this range.
    """

    _wants_devkit = True

    def __init__(self, *, max_depth_m: float = 80.0, crop: Crop = "none") -> None:
        """Makes an evaluator without pictures.

        Args:
            max_depth_m: largest true depth that metrics with the prefix `eigen_` count, metres.
            crop: part of the picture that these metrics count: `none` (all of it), `garg` or `eigen`.
        """
        self.max_depth_m = max_depth_m
        self.crop = crop
        self.metrics: dict[str, list[float]] = {}

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Adds a predicted (H, W) depth map in metres; returns the metrics of this picture.

        Args:
            sample: a sample with its true depth.
            prediction: (H, W) predicted depth.

        Raises:
            ValueError: the prediction has another shape than the ground truth, or is not positive and finite where
                there is ground truth.
        """
        truth_m, prediction = sample.depth_m, np.asarray(prediction, np.float32)  # as it is kept in files
        if prediction.shape != truth_m.shape:
            raise ValueError(f"prediction must have shape {truth_m.shape}, got {prediction.shape}")
        near = (truth_m > MIN_DEPTH_M) & (truth_m < self.max_depth_m)
        if self.crop != "none":
            near &= self._window(truth_m.shape)
        most_m = min(self.max_depth_m, MAX_PNG_DEPTH_M)
        both = near & (prediction >= MIN_CODED_DEPTH_M) & (prediction <= most_m) & (truth_m <= MAX_PNG_DEPTH_M)
        others = np.isfinite(truth_m) & ~both
        other_truth_m, other_found_m = truth_m[others], prediction[others]
        if not np.isfinite(other_found_m).all() or (other_found_m <= 0).any():
            raise ValueError("prediction must be positive and finite wherever there is ground truth")
        shared = _summed(truth_m[both], prediction[both])  # most pixels, and worked on once for both kinds of metrics
        found = {}
        if self._wants_devkit:
            coded = other_truth_m <= MAX_PNG_DEPTH_M
            kept_m = other_found_m[coded].clip(MIN_CODED_DEPTH_M, MAX_PNG_DEPTH_M)
            found = _devkit(shared + _summed(other_truth_m[coded], kept_m))
        strays = near[others]
        clipped_m = other_found_m[strays].clip(MIN_DEPTH_M, self.max_depth_m)
        found |= _eigen(shared + _summed(other_truth_m[strays], clipped_m))
        for name, value in found.items():
            self.metrics.setdefault(name, []).append(value)
        return found

    def _window(self, shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
        height, width = shape[0], shape[1]
        top, bottom, left, right = CROPS[self.crop]
        window = np.zeros((height, width), dtype=np.bool_)
        window[int(top * height) : int(bottom * height), int(left * width) : int(right * width)] = True
        return window

    def merge(self, other: Any) -> None:
        """Adds the pictures that another evaluator of this class has gathered.

        Args:
            other: the other evaluator; it is not changed.
        """
        for name, values in other.metrics.items():
            self.metrics.setdefault(name, []).extend(values)

    def result(self) -> Mapping[str, float]:
        """The metrics by name: means over the pictures that have ground truth.

        Names are `mae_m`, `rmse_m`, `imae_per_km`, `irmse_per_km`, `log_mae`, `log_rmse`, `silog` (x100), `abs_rel` and
        `sq_rel` (squared error over squared depth); `eigen_d1` to `eigen_d3`, `eigen_abs_rel`, `eigen_sq_rel` (squared
        error over depth), `eigen_rmse_m`, `eigen_rmse_log`, `eigen_log10` and `eigen_silog`.
        """
        known = {name: [v for v in self.metrics.get(name, []) if v == v] for name in self._names()}
        # Sorted, so that the order in which pictures came does not reach the last digit.
        return {name: float(np.mean(np.sort(values))) if values else float("nan") for name, values in known.items()}

    def resampled(self, draws: Draws) -> Spread:
        """The metrics of `result` for R resampled datasets, from which confidence intervals are computed.

        Args:
            draws: (R, N) picture indices in the order of the calls of `update`; row r lists the pictures of dataset r,
                over which the mean is taken.

        Returns:
            (R,) values by name of the metric; NaN where no picture has ground truth.
        """
        values = {name: np.array(self.metrics.get(name, []), np.float64) for name in self._names()}
        return {name: known_means(one[draws]) for name, one in values.items() if len(one)}

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric: 0 and 1 for `d1` to `d3` (shares of pixels), 0 and
        infinity for errors.

        Args:
            metric: name of the metric, with or without the prefix `eigen_`.
        """
        return 0.0, 1.0 if metric.removeprefix("eigen_") in SHARES else math.inf

    def lower_is_better(self, metric: str) -> bool | None:
        """False for `d1` to `d3`, the shares of pixels with a small error; True for all other metrics, which are
        errors.

        Args:
            metric: name of the metric, with or without the prefix `eigen_`.
        """
        return metric.removeprefix("eigen_") not in SHARES

    @staticmethod
    def _names() -> tuple[str, ...]:
        return (*_devkit(_Sums()), *_eigen(_Sums()))


class NearDepth(DepthEvaluator):
    """The metric with which gear compares its reference networks of depth: whole pictures, true depths below 80 m,
    no sky.

    Predictions are clipped to 80 m. The devkit's metrics are not included.
    """

    _wants_devkit = False

    def __init__(self) -> None:
        """Makes an evaluator without pictures; the options of `DepthEvaluator` are fixed."""
        super().__init__(max_depth_m=80.0, crop="none")

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Adds a predicted (H, W) depth map in metres; returns the metrics of this picture.

        Args:
            sample: the sample with its true depth.
            prediction: (H, W) predicted depth in metres.
        """
        return _renamed(super().update(sample, prediction))

    def result(self) -> Mapping[str, float]:
        """The metrics by name: `d1`, `rmse_m`, `d2`, `d3`, `abs_rel`, `sq_rel`, `rmse_log`, `log10` and `silog`,
        as means over pictures.
        """
        return _renamed(super().result())

    def resampled(self, draws: Draws) -> Spread:
        """The metrics of `result` for R resampled datasets, from which confidence intervals are computed.

        Args:
            draws: (R, N) picture indices in the order of the calls of `update`; row r lists the pictures of dataset r,
                over which the mean is taken.

        Returns:
            (R,) values by name of the metric; NaN where no picture has ground truth.
        """
        return _renamed(super().resampled(draws))


def known_means(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The means of rows without their NaN values.

    Args:
        values: (R, N) values.

    Returns:
        (R,) means; NaN where a row has no other value.
    """
    known = ~np.isnan(values)
    count = known.sum(axis=1)
    return np.asarray(np.where(known, values, 0).sum(axis=1) / np.where(count, count, np.nan), np.float64)


def _renamed(metrics: Mapping[str, T]) -> dict[str, T]:
    """Renames Eigen's metrics to names without the prefix."""
    prefix = "eigen_"
    plain = {name.removeprefix(prefix): value for name, value in metrics.items() if name.startswith(prefix)}
    first = {name: plain[name] for name in ("d1", "rmse_m")}
    return first | plain


class _Sums:
    """Sums over pixels of the quantities of all metrics."""

    def __init__(self, sums: Mapping[str, float] | None = None) -> None:
        self._sums = dict(sums or {})

    def __add__(self, other: _Sums) -> _Sums:
        names = self._sums | other._sums
        return _Sums({name: self._sums.get(name, 0.0) + other._sums.get(name, 0.0) for name in names})

    def mean(self, name: str) -> float:
        """Mean of a sum over the pixels; NaN if there are none."""
        pixels = self._sums.get("pixels", 0.0)
        return self._sums[name] / pixels if pixels else float("nan")


def _summed(truth_m: FloatImage, found_m: FloatImage) -> _Sums:
    """The sums over pixels with (N,) true and predicted depths in metres."""
    sums = _Sums()
    for start in range(0, truth_m.size, PIXELS_AT_ONCE):
        sums += _sums_of_piece(truth_m[start : start + PIXELS_AT_ONCE], found_m[start : start + PIXELS_AT_ONCE])
    return sums


def _sums_of_piece(truth_m: FloatImage, found_m: FloatImage) -> _Sums:
    """The sums over one piece of the pixels: single precision per pixel, as depths are stored, and sums in double
    precision.

    Double precision keeps the variance in `silog` accurate where it is the small difference of large means. NumPy adds
    in an order that depends only on the number of values. OpenCV's `sumElems` adds float32 in an order that depends on
    the array's address, so that the result for a picture is not always the same.
    """
    most, least = max(truth_m.max(), found_m.max()), min(truth_m.min(), found_m.min())
    if (
        most > SINGLE_PRECISION_M or least < 1 / SINGLE_PRECISION_M
    ):  # their squares and quotients may leave single precision's range
        truth_m, found_m = truth_m.astype(np.float64), found_m.astype(np.float64)
    error_m = found_m - truth_m
    relative = error_m / truth_m
    inverse = relative / found_m
    log = cv2.log(found_m / truth_m).reshape(-1)
    log_size = np.abs(log)
    return _Sums(
        {
            "pixels": truth_m.size,
            "error": _sum(np.abs(error_m)),
            "error_square": _sum_of_squares(error_m),
            "inverse": _sum(np.abs(inverse)),
            "inverse_square": _sum_of_squares(inverse),
            "log": _sum(log),
            "log_size": _sum(log_size),
            "log_square": _sum_of_squares(log),
            "relative": _sum(np.abs(relative)),
            "relative_square": _sum_of_squares(relative),
            "error_relative": _sum(error_m * relative),
            "d1": _count_within(1.25, log_size, truth_m, found_m),
            "d2": _count_within(1.25**2, log_size, truth_m, found_m),
            "d3": _count_within(1.25**3, log_size, truth_m, found_m),
        }
    )


def _sum(values: npt.NDArray[np.floating[Any]]) -> float:
    return float(np.add.reduce(values, dtype=np.float64))


def _sum_of_squares(values: npt.NDArray[np.floating[Any]]) -> float:
    return float(np.add.reduce(np.square(values, dtype=np.float64)))


def _count_within(ratio: float, log_size: Array, truth_m: FloatImage, found_m: FloatImage) -> int:
    """Number of pixels whose depths differ by less than a factor; pixels too close to the factor are decided in double
    precision.
    """
    bound = math.log(ratio)
    count = int(np.count_nonzero(log_size < bound - LOG_ERROR))
    if np.count_nonzero(log_size < bound + LOG_ERROR) == count:
        return count
    places = np.flatnonzero(np.abs(log_size - bound) <= LOG_ERROR)
    truth_m, found_m = truth_m.take(places).astype(np.float64), found_m.take(places).astype(np.float64)
    return count + int(np.count_nonzero(np.maximum(truth_m / found_m, found_m / truth_m) < ratio))


def _devkit(sums: _Sums) -> dict[str, float]:
    return {
        "mae_m": sums.mean("error"),
        "rmse_m": _root(sums.mean("error_square")),
        "imae_per_km": 1000 * sums.mean("inverse"),
        "irmse_per_km": 1000 * _root(sums.mean("inverse_square")),
        "log_mae": sums.mean("log_size"),
        "log_rmse": _root(sums.mean("log_square")),
        "silog": 100 * _root(sums.mean("log_square") - sums.mean("log") ** 2),
        "abs_rel": sums.mean("relative"),
        "sq_rel": sums.mean("relative_square"),
    }


def _eigen(sums: _Sums) -> dict[str, float]:
    return {
        "eigen_d1": sums.mean("d1"),
        "eigen_d2": sums.mean("d2"),
        "eigen_d3": sums.mean("d3"),
        "eigen_abs_rel": sums.mean("relative"),
        "eigen_sq_rel": sums.mean("error_relative"),
        "eigen_rmse_m": _root(sums.mean("error_square")),
        "eigen_rmse_log": _root(sums.mean("log_square")),
        "eigen_log10": sums.mean("log_size") / math.log(10),
        "eigen_silog": _root(sums.mean("log_square") - 0.5 * sums.mean("log") ** 2),
    }


def _root(value: float) -> float:
    return float(np.sqrt(max(value, 0.0))) if value == value else value
