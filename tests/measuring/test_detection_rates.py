"""True positive rates at fixed false alarms, against counts that are written out."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import stats

from gear.measuring.detection_rates import alarms, share_interval, threshold_at
from gear.values.rng import derive_rng

CASES = list(itertools.product([1, 7, 20, 99, 100, 101, 400], [0.0, 0.01, 0.05, 0.5]))


@pytest.mark.parametrize(("count", "share"), CASES)
def test_the_threshold_is_the_smallest_that_keeps_the_share(count: int, share: float) -> None:
    clean = derive_rng(count, "clean").integers(0, 30, count) / 10  # with ties
    threshold = threshold_at(clean.tolist(), share)
    assert (clean > threshold).mean() <= share + 1e-12
    lower = clean[clean < threshold]
    if len(lower):
        assert (clean > lower.max()).mean() > share


def test_few_pictures_allow_no_alarm() -> None:
    assert threshold_at([0.1, 0.9, 0.4], 0.05) == 0.9
    assert threshold_at([float(n) for n in range(100)], 0.01) == 98.0
    with pytest.raises(ValueError, match="at least one"):
        threshold_at([], 0.05)


def test_an_alarm_is_above_the_threshold() -> None:
    assert alarms([0.5, 0.500001, 0.4], 0.5).tolist() == [False, True, False]


@pytest.mark.parametrize(("count", "total"), [(0, 5), (5, 5), (3, 24), (120, 240)])
def test_the_interval_is_that_of_scipy(count: int, total: int) -> None:
    wanted = stats.binomtest(count, total).proportion_ci(0.95, method="exact")
    np.testing.assert_allclose(share_interval(count, total), (wanted.low, wanted.high), atol=1e-9)
