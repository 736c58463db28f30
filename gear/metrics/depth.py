"""Monocular depth: the figures of KITTI's devkit and the customary ones of Eigen et al.; means over pictures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
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

PIECE = 1 << 15
"""Pixels at a time: few enough that what is worked out of them stays in the processor's cache."""


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

    _wants_devkit = True

    def __init__(self, *, max_depth_m: float = 80.0, crop: Crop = "none") -> None:
        self.max_depth_m = max_depth_m
        self.crop = crop
        self.figures: dict[str, list[float]] = {}

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Takes (H, W) metres; returns this picture's figures.

        Raises:
            ValueError: the prediction has another shape, or is not positive and finite where there is ground truth.
        """
        truth_m, prediction = sample.depth_m, np.asarray(prediction, np.float32)  # as it is kept in files
        if prediction.shape != truth_m.shape:
            raise ValueError(f"prediction must have shape {truth_m.shape}, got {prediction.shape}")
        everywhere, near = _Sums(), _Sums()
        window = self._window(truth_m.shape).reshape(-1)
        flat_truth_m, flat_found_m = truth_m.reshape(-1), prediction.reshape(-1)
        for start in range(0, truth_m.size, PIECE):
            piece = slice(start, start + PIECE)
            known = np.flatnonzero(np.isfinite(flat_truth_m[piece]))
            if not known.size:
                continue
            found_m, seen_m = flat_found_m[piece].take(known), flat_truth_m[piece].take(known)
            if not np.isfinite(found_m).all() or (found_m <= 0).any():
                raise ValueError("prediction must be positive and finite wherever there is ground truth")
            pair = _Pair.of(seen_m.astype(np.float64), found_m.astype(np.float64))
            if self._wants_devkit:
                everywhere.add(_devkit_sums(pair))
            looked_at = (seen_m > MIN_DEPTH_M) & (seen_m < self.max_depth_m)
            if self.crop != "none":
                looked_at &= window[piece].take(known)
            near.add(_eigen_sums(pair.where(looked_at).clipped(MIN_DEPTH_M, self.max_depth_m)))
        found = _devkit(everywhere) if self._wants_devkit else {}
        found |= _eigen(near)
        for name, value in found.items():
            self.figures.setdefault(name, []).append(value)
        return found

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
        names = (*_devkit(_Sums()), *_eigen(_Sums()))
        known = {name: [v for v in self.figures.get(name, []) if v == v] for name in names}
        # Sorted, so that the order in which pictures came does not reach the last digit.
        return {name: float(np.mean(np.sort(values))) if values else float("nan") for name, values in known.items()}


class NearDepth(DepthEvaluator):
    """What a reference network is held to: whole pictures below 80 m, predictions clipped there; no sky.

    The devkit's figures are not shown.
    """

    _wants_devkit = False

    def __init__(self) -> None:
        super().__init__(max_depth_m=80.0, crop="none")

    def update(self, sample: DepthTruth, prediction: FloatImage) -> Mapping[str, float]:
        """Takes (H, W) metres; returns this picture's figures."""
        return _renamed(super().update(sample, prediction))

    def result(self) -> Mapping[str, float]:
        """`d1`, `rmse_m`, `d2`, `d3`, `abs_rel`, `sq_rel`, `rmse_log`, `log10`, `silog`: means over pictures."""
        return _renamed(super().result())


def _renamed(figures: Mapping[str, float]) -> dict[str, float]:
    """Eigen's figures without their prefix."""
    prefix = "eigen_"
    plain = {name.removeprefix(prefix): value for name, value in figures.items() if name.startswith(prefix)}
    first = {name: plain[name] for name in ("d1", "rmse_m")}
    return first | plain


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Depth of the same pixels, (N,) float64 metres, and what several figures are made of."""

    truth_m: Array
    found_m: Array
    error_m: Array
    relative: Array
    log: Array

    @classmethod
    def of(cls, truth_m: Array, found_m: Array) -> _Pair:
        error_m = found_m - truth_m
        return cls(truth_m, found_m, error_m, error_m / truth_m, np.log(found_m) - np.log(truth_m))

    def where(self, chosen: npt.NDArray[np.bool_]) -> _Pair:
        if chosen.all():
            return self
        places = np.flatnonzero(chosen)
        parts = (self.truth_m, self.found_m, self.error_m, self.relative, self.log)
        return _Pair(*(part.take(places) for part in parts))

    def clipped(self, least_m: float, most_m: float) -> _Pair:
        if not self.found_m.size or (self.found_m.min() >= least_m and self.found_m.max() <= most_m):
            return self
        return _Pair.of(self.truth_m, np.clip(self.found_m, least_m, most_m))


class _Sums:
    """Sums over pixels, by name, piece after piece."""

    def __init__(self) -> None:
        self._sums: dict[str, float] = {}

    def add(self, sums: Mapping[str, float]) -> None:
        for name, value in sums.items():
            self._sums[name] = self._sums.get(name, 0.0) + float(value)

    def mean(self, name: str) -> float:
        """NaN where there were no pixels."""
        pixels = self._sums.get("pixels", 0.0)
        return self._sums[name] / pixels if pixels else float("nan")


def _devkit_sums(pair: _Pair) -> dict[str, float]:
    inverse = pair.relative / pair.found_m
    return {
        "pixels": pair.truth_m.size,
        "error": np.abs(pair.error_m).sum(),
        "error_square": np.square(pair.error_m).sum(),
        "inverse": np.abs(inverse).sum(),
        "inverse_square": np.square(inverse).sum(),
        "log": pair.log.sum(),
        "log_size": np.abs(pair.log).sum(),
        "log_square": np.square(pair.log).sum(),
        "relative": np.abs(pair.relative).sum(),
        "relative_square": np.square(pair.relative).sum(),
    }


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


def _eigen_sums(pair: _Pair) -> dict[str, float]:
    ratio = np.maximum(pair.truth_m / pair.found_m, pair.found_m / pair.truth_m)
    return {
        "pixels": pair.truth_m.size,
        "d1": np.count_nonzero(ratio < 1.25),
        "d2": np.count_nonzero(ratio < 1.25**2),
        "d3": np.count_nonzero(ratio < 1.25**3),
        "relative": np.abs(pair.relative).sum(),
        "error_relative": (pair.error_m * pair.relative).sum(),
        "error_square": np.square(pair.error_m).sum(),
        "log": pair.log.sum(),
        "log_size": np.abs(pair.log).sum(),
        "log_square": np.square(pair.log).sum(),
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
