"""Z-scores of features with respect to clean pictures, and alarm levels for scores."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gear.values.errors import GearError

LEAST_LEVEL = 1e-9
"""Smallest alarm level, because a level of 0 would make every score 1."""

FLOOR = 0.01
"""Share of the mean deviation that is added to each deviation. Otherwise a feature that was constant in the calibration
has deviation 0, and its smallest change would outweigh all other features.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CleanStatistics:
    """Mean and standard deviation of each feature on clean pictures (without patch).

    Attributes:
        mean, deviation: tensors in the shape of the features, float64.
    """

    mean: Tensor
    deviation: Tensor

    def z_scores(self, values: Tensor) -> Tensor:
        """Returns the z-scores of features: (values - mean) / deviation, float64. A share `FLOOR` of the mean
        deviation is added to each deviation.

        Args:
            values: features in the shape of `mean`.

        Raises:
            GearError: the features have another shape than in the calibration, because the pictures have another size.
        """
        if values.shape != self.mean.shape:
            here, there = (" x ".join(map(str, one.shape)) for one in (values, self.mean))
            raise GearError(
                f"the feature map has {here} numbers, and had {there} in calibration: calibrate on such pictures"
            )
        return (values.double() - self.mean) / (self.deviation + FLOOR * self.deviation.mean()).clamp_min(1e-12)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Moments:
    """Count, mean and sum of squared deviations of several feature tensors, for computing standard deviations.

    Attributes:
        count: number of tensors.
        mean: mean of each feature, float64.
        squares: sum of squared deviations from the mean, for each feature, float64.
    """

    count: int
    mean: Tensor
    squares: Tensor

    def merged(self, other: Moments) -> Moments:
        """Returns the moments of two sets of feature tensors taken together (Chan, Golub and LeVeque, 1979).

        Args:
            other: moments of the second set.

        Raises:
            GearError: the features of the two sets have different shapes.
        """
        if not self.count or not other.count:
            return self if self.count else other
        if self.mean.shape != other.mean.shape:
            raise GearError("calibration pictures must all have one size")
        count, change = self.count + other.count, other.mean - self.mean
        mean = self.mean + change * (other.count / count)
        squares = self.squares + other.squares + change * change * (self.count * other.count / count)
        return Moments(count=count, mean=mean, squares=squares)

    def clean_statistics(self) -> CleanStatistics:
        """Returns mean and standard deviation of each feature.

        Raises:
            GearError: the moments cover fewer than two tensors.
        """
        if self.count < 2:
            raise GearError(f"a calibration needs at least two pictures to say what is usual, got {self.count}")
        return CleanStatistics(mean=self.mean, deviation=(self.squares / (self.count - 1)).sqrt())


NO_MOMENTS = Moments(count=0, mean=torch.zeros(()), squares=torch.zeros(()))


def moments(samples: Iterable[Tensor]) -> Moments:
    """Computes count, mean and sum of squared deviations over feature tensors, in one pass.

    Args:
        samples: feature tensors of one shape, one per picture.

    Raises:
        GearError: the shapes differ.
    """
    total = NO_MOMENTS
    for sample in samples:
        values = sample.double()
        total = total.merged(Moments(count=1, mean=values, squares=torch.zeros_like(values)))
    return total


def clean_statistics(samples: Iterable[Tensor]) -> CleanStatistics:
    """Computes mean and standard deviation of each feature over feature tensors, in one pass.

    Args:
        samples: feature tensors of one shape, one per clean picture.

    Raises:
        GearError: there are fewer than two tensors, or their shapes differ.
    """
    return moments(samples).clean_statistics()


def alarm_level(clean: Sequence[float], false_alarms: float) -> float:
    """Returns the score that a new clean picture exceeds with a probability of at most `false_alarms`.

    It is the score of rank ceil((n + 1)(1 - false_alarms)) among the n clean scores. Averaged over all draws of the
    calibration pictures, the bound holds for any distribution of the scores (Vovk et al., 2005). It would not hold for
    a quantile that is interpolated between scores.

    Args:
        clean: scores of the n clean calibration pictures, in any order.
        false_alarms: share of clean pictures that may exceed the level, between 0 and 1.

    Raises:
        GearError: there are too few scores for such a rank.
    """
    rank = _rank(len(clean), false_alarms)
    if rank > len(clean):
        needed = math.ceil(1 / false_alarms - 1)
        raise GearError(
            f"{len(clean)} clean calibration pictures are too few for an alarm level that at most {false_alarms:g} of "
            f"clean pictures exceed; give at least {needed} (--calibration DIR), or raise it with "
            "--defense-set false_alarms=SHARE"
        )
    return float(np.sort(np.asarray(clean, dtype=np.float64))[rank - 1])


def false_alarm_interval(count: int, false_alarms: float) -> tuple[float, float]:
    """The 95 % interval (low, high) of the share of new, similar clean pictures that exceed the alarm level.

    The share above the k-th of n scores has the distribution Beta(n + 1 - k, k) over draws of the n calibration
    pictures. Pictures of other scenes may exceed the level more often.

    Args:
        count: number of clean pictures in the calibration.
        false_alarms: share of clean pictures that may exceed the level, 0..1.
    """
    from scipy import stats

    rank = _rank(count, false_alarms)
    low, high = stats.beta.ppf((0.025, 0.975), count + 1 - rank, rank)
    return float(low), float(high)


def _rank(count: int, false_alarms: float) -> int:
    return math.ceil(round((count + 1) * (1 - false_alarms), 9))


def normalised_score(raw: float, level: float) -> float:
    """Converts a raw score to a score in 0..1: raw / (raw + level), which is 0.5 at the alarm level; 1 if it is
    not finite.

    Args:
        raw: raw score, 0 or more.
        level: alarm level of raw scores.
    """
    if not math.isfinite(raw):
        return 1.0
    return raw / (raw + max(level, LEAST_LEVEL))


def normalised_score_tensor(raw: Tensor, level: float) -> Tensor:
    """Converts raw scores to scores in 0..1: raw / (raw + level), with gradients.

    Args:
        raw: (B,) raw scores, 0 or more.
        level: alarm level of raw scores.
    """
    return raw / (raw + max(level, LEAST_LEVEL))
