"""Intervals of 95 % cover a known truth in 92 to 97 % of simulated datasets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import binomtest, poisson

from benchmarks.coverage import BY_NAME, KINDS, coverage
from gear.measuring.intervals import (
    CONFIDENCE,
    LEFT_OUT,
    MOST_GROUPS,
    extreme_rate_interval,
    jackknife_interval,
    leave_one_out,
    separated_interval,
)
from gear.measuring.statistics import auroc_interval
from gear.values.rng import derive_rng


def test_every_row_leaves_one_cluster_out() -> None:
    rows = leave_one_out(["a", "b", "a", "c"])
    assert [sorted(row[row != LEFT_OUT]) for row in rows] == [[1, 3], [0, 2, 3], [0, 1, 2]]
    assert leave_one_out(["a"]).shape == (0, 1) and leave_one_out(["a", "a"]).shape == (0, 2)
    assert leave_one_out([]).shape == (0, 0)


def test_many_clusters_are_left_out_in_groups() -> None:
    rows = leave_one_out(range(3 * MOST_GROUPS))
    left_out = [set(range(3 * MOST_GROUPS)) - set(row[row != LEFT_OUT]) for row in rows]
    assert len(rows) == MOST_GROUPS and {len(one) for one in left_out} == {3}
    assert set.union(*left_out) == set(range(3 * MOST_GROUPS))


def test_of_a_mean_it_is_students() -> None:
    values = derive_rng(0, "mean").normal(3, 2, 12)
    interval = jackknife_interval(float(values.mean()), (values.sum() - values) / 11)
    reach = 2.200985 * values.std(ddof=1) / math.sqrt(12)  # t of 11 degrees of freedom
    assert interval == pytest.approx((values.mean() - reach, values.mean() + reach))


def test_two_samples_say_little() -> None:
    """Student's t of one degree of freedom is 12.7: of two pictures, any mIoU is possible."""
    assert jackknife_interval(0.124, np.array([0.137, 0.111]), (0, 1)) == pytest.approx((0, 0.289), abs=1e-3)
    assert jackknife_interval(0.5, np.array([0.4, 0.7]), (0, 1)) == (0, 1)


def test_samples_that_do_not_differ() -> None:
    assert jackknife_interval(0.3, np.full(7, 0.3)) == (0.3, 0.3)
    assert jackknife_interval(0.0, np.zeros(7)) == (0, 0)
    jittered = 0.3 + 1e-16 * np.arange(7)
    assert jackknife_interval(0.3, jittered) == (0.3, 0.3), "rounding is no spread"


def test_what_rests_on_one_street_has_no_interval() -> None:
    assert jackknife_interval(0.3, np.array([0.3, np.nan, 0.3])) is None
    assert jackknife_interval(math.nan, np.array([0.3, 0.4])) is None
    assert jackknife_interval(0.3, np.array([0.3])) is None and jackknife_interval(0.3, np.array([])) is None


def test_few_streets_that_matter_count_for_few() -> None:
    """Of twenty streets two show the class: three degrees of freedom, not nineteen, whose t is 2.1."""
    replicates = np.array([0.4, 0.6] + [0.5] * 18)
    low, high = jackknife_interval(0.5, replicates) or (0, 0)
    error = math.sqrt(19 / 20 * np.square(replicates - 0.5).sum())
    assert (high - low) / 2 == pytest.approx(3.182446 * error)


def test_scores_that_happen_to_be_separated_may_not_always_be() -> None:
    low, high = auroc_interval([0.9] * 14, [0.1] * 14, range(14)) or (0, 0)
    assert 0.7 < low < 0.95 and high == 1
    assert auroc_interval([0.1] * 14, [0.9] * 14, range(14)) == pytest.approx((0, 1 - low))
    assert separated_interval(1.0, 200)[0] > 0.97
    assert auroc_interval([0.9], [0.1], [0]) is None


@pytest.mark.parametrize("count", [1, 3, 14, 500])
def test_rates_of_0_and_1_have_the_exact_intervals(count: int) -> None:
    for events in (0, count):
        exact = binomtest(events, count).proportion_ci(CONFIDENCE, method="exact")
        assert extreme_rate_interval(events / count, count, (0, 1)) == pytest.approx((exact.low, exact.high))
    low, high = extreme_rate_interval(0, count, (0, math.inf))
    assert low == 0 and high == pytest.approx(poisson_upper(count))


def poisson_upper(count: int) -> float:
    """The mean of each cluster for which no event in all of them has a probability of 2.5 %."""
    return float(brentq(lambda mean: poisson.pmf(0, mean * count) - 0.025, 0, 10))


@pytest.mark.parametrize("limits", [(0.0, 1.0), (0.0, math.inf)])
@pytest.mark.parametrize("rate", [0.02, 0.1, 0.3])
def test_intervals_of_extreme_rates_cover_a_known_truth(limits: tuple[float, float], rate: float) -> None:
    """Of 4000 simulated datasets of 14 streets, the share that has no event at all and misses the rate."""
    rng = derive_rng(0, "extreme", str(limits), str(rate))
    events = rng.binomial(1, rate, (4000, 14)) if limits[1] == 1 else rng.poisson(rate, (4000, 14))
    is_missed = (events.sum(axis=1) == 0) & (extreme_rate_interval(0, 14, limits)[1] < rate)
    assert is_missed.mean() <= 0.025 + 3 * math.sqrt(0.025 * 0.975 / 4000)


@pytest.mark.parametrize("kind", KINDS)
def test_intervals_cover_a_known_truth(kind: str) -> None:
    """The bounds are 92 to 97 %, three standard errors of 200 simulations wider."""
    found = coverage(BY_NAME[kind], samples=8, simulations=200, methods=("jackknife",), seed=1)
    assert 0.86 <= found["jackknife"] <= 1.0, found


def test_percentiles_of_a_bootstrap_do_not() -> None:
    found = coverage(BY_NAME["miou"], samples=5, simulations=100, methods=("percentile",), seed=1)
    assert found["percentile"] < 0.86, "resamples show fewer classes, and five pictures are few"
