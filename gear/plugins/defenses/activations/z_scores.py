"""How far numbers lie from what they usually are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gear.values.errors import GearError

LEAST_LEVEL = 1e-9
"""An alarm level of 0 would make every score 1."""

FLOOR = 0.01
"""Of the mean deviation, added to each. A number that never changed in calibration has none: the least change of it
would outweigh all others."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Usual:
    """What is usual.

    Attributes:
        mean, deviation: of each number, float64.
    """

    mean: Tensor
    deviation: Tensor

    def z_scores(self, values: Tensor) -> Tensor:
        """(values - mean) / deviation.

        Raises:
            GearError: their shape is not that of the calibration, so pictures have another size.
        """
        if values.shape != self.mean.shape:
            here, there = (" x ".join(map(str, one.shape)) for one in (values, self.mean))
            raise GearError(
                f"the feature map has {here} numbers, and had {there} in calibration: calibrate on such pictures"
            )
        return (values.double() - self.mean) / (self.deviation + FLOOR * self.deviation.mean()).clamp_min(1e-12)


def usual(samples: Iterable[Tensor]) -> Usual:
    """Means and deviations over samples of one shape, in one pass (Welford, 1962).

    Raises:
        GearError: there are fewer than two, or shapes differ.
    """
    count, mean, squares = 0, torch.zeros(()), torch.zeros(())
    for sample in samples:
        values = sample.double()
        if count and values.shape != mean.shape:
            raise GearError("calibration pictures must all have one size")
        count += 1
        if count == 1:
            mean, squares = values.clone(), torch.zeros_like(values)
            continue
        change = values - mean
        mean = mean + change / count
        squares = squares + change * (values - mean)
    if count < 2:
        raise GearError(f"a calibration needs at least two pictures to say what is usual, got {count}")
    return Usual(mean=mean, deviation=(squares / (count - 1)).sqrt())


def alarm_level(clean: Sequence[float], false_alarms: float) -> float:
    """What the share `false_alarms` of clean scores exceeds."""
    return float(np.quantile(np.asarray(clean, dtype=np.float64), 1 - false_alarms))


def sureness(raw: float, level: float) -> float:
    """A score in 0..1 that grows with `raw` (0 or more) and is 0.5 at `level`."""
    if not math.isfinite(raw):
        return 1.0
    return raw / (raw + max(level, LEAST_LEVEL))


def sureness_tensor(raw: Tensor, level: float) -> Tensor:
    """As `sureness`, of (B,) scores with their gradient."""
    return raw / (raw + max(level, LEAST_LEVEL))
