"""True positive rates of a detector at fixed rates of false alarms, with a threshold that was set in other scenes.

An AUROC is a property of scores alone. A detector in use needs a threshold, and the scene in which it will work is
unknown when the threshold is set. Therefore the threshold comes from clean pictures of other scenes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.measuring.intervals import CONFIDENCE

FALSE_ALARMS = (0.01, 0.05)
"""Shares of clean pictures that may raise an alarm where the threshold is set."""


def threshold_at(clean: Sequence[float], false_alarms: float) -> float:
    """Returns the smallest threshold at which no more than a share of the clean pictures raise an alarm.

    A picture raises an alarm if its score is above the threshold. With fewer than 1 / `false_alarms` pictures no
    picture may raise an alarm, so the threshold is the largest score.

    Args:
        clean: scores of pictures without a patch, at least one.
        false_alarms: the share, 0 to less than 1.

    Raises:
        ValueError: there are no scores.
    """
    if not len(clean):
        raise ValueError("a threshold needs at least one clean score")
    allowed = math.floor(false_alarms * len(clean) + 1e-9)
    return float(np.sort(np.asarray(clean, np.float64))[len(clean) - 1 - allowed])


def alarms(scores: Sequence[float], threshold: float) -> npt.NDArray[np.bool_]:
    """Returns which pictures raise an alarm.

    Args:
        scores: (N,) scores.
        threshold: pictures with a score above it raise an alarm.

    Returns:
        (N,) bool.
    """
    raised: npt.NDArray[np.bool_] = np.asarray(scores, np.float64) > threshold
    return raised


def share_interval(count: int, total: int) -> tuple[float, float]:
    """Returns the exact 95 % confidence interval of a share (Clopper and Pearson, Biometrika 1934).

    Args:
        count: number of pictures with an alarm.
        total: number of pictures, at least 1.
    """
    from scipy import stats

    tail = (1 - CONFIDENCE) / 2
    low = float(stats.beta.ppf(tail, count, total - count + 1)) if count else 0.0
    high = float(stats.beta.isf(tail, count + 1, total - count)) if count < total else 1.0
    return low, high
