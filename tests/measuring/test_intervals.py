"""Intervals of 95 % cover a known truth in 92 to 97 % of simulated datasets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import binomtest, poisson, skew
from scipy.stats import t as students_t

from benchmarks.coverage import AGAINST_ALL, BY_NAME, KINDS, coverage
from gear.measuring.intervals import (
    CONFIDENCE,
    LEFT_OUT,
    MOST_GROUPS,
    combined_interval,
    interval_at_limit,
    is_constant,
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


def test_of_a_symmetric_mean_it_is_students() -> None:
    half = derive_rng(0, "mean").normal(3, 2, 6)
    values = np.concatenate([half, 6 - half])
    interval = jackknife_interval(float(values.mean()), (values.sum() - values) / 11)
    reach = 2.228139 * values.std(ddof=1) / math.sqrt(12)  # t of 10 degrees of freedom
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


@pytest.mark.parametrize("sign", [1, -1])
def test_the_longer_side_of_an_interval_is_that_of_the_long_tail(sign: int) -> None:
    """The ends fulfil Hall's equation g(T) = t, by its definition and not by its inverse."""
    values = sign * derive_rng(0, "skewed").lognormal(0, 1, 12)
    low, high = jackknife_interval(float(values.mean()), (values.sum() - values) / 11) or (0, 0)
    above, below = high - values.mean(), values.mean() - low
    assert above > 1.2 * below if sign > 0 else below > 1.2 * above
    error = values.std(ddof=1) / math.sqrt(12)
    a = float(skew(values)) / math.sqrt(12)
    squares = np.square(values - values.mean())
    reach = students_t.ppf(0.975, min(10, 3 * (squares.sum() ** 2 / np.square(squares).sum() - 1) - 1))
    for end, quantile in ((low, reach), (high, -reach)):
        studentised = (values.mean() - end) / error
        transformed = studentised + a * studentised**2 / 3 + a**2 * studentised**3 / 27 + a / 6
        assert transformed == pytest.approx(quantile)


def test_few_streets_that_matter_count_for_few() -> None:
    """Of twenty streets two show the class: two degrees of freedom, not eighteen, whose t is 2.1."""
    replicates = np.array([0.4, 0.6] + [0.5] * 18)
    low, high = jackknife_interval(0.5, replicates) or (0, 0)
    error = math.sqrt(19 / 20 * np.square(replicates - 0.5).sum())
    assert (high - low) / 2 == pytest.approx(4.302653 * error)


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
        assert interval_at_limit(events / count, count, (0, 1)) == pytest.approx((exact.low, exact.high))
    low, high = interval_at_limit(0, count, (0, math.inf))
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
    is_missed = (events.sum(axis=1) == 0) & (interval_at_limit(0, 14, limits)[1] < rate)
    assert is_missed.mean() <= 0.025 + 3 * math.sqrt(0.025 * 0.975 / 4000)


def test_ends_of_a_difference_are_combined_as_squares() -> None:
    """Nothing of a patched picture is found, and 0.6 of a clean one: the change is -0.6."""
    low, high = combined_interval(0.0, (0.0, 0.3), 0.6, (0.4, 0.9))
    assert (low, high) == pytest.approx((-0.6 - 0.3, -0.6 + math.hypot(0.3, 0.2)))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != AGAINST_ALL])
def test_intervals_cover_a_known_truth(kind: str) -> None:
    """The bounds are 92 to 97 %, three standard errors of 200 simulations (KITTI: 60) wider. Metrics that are mostly at
    their limits may be covered more often, because Clopper and Pearson's intervals are conservative.
    """
    found = coverage(BY_NAME[kind], samples=8, simulations=60 if "KITTI" in kind else 200, methods=("gear",), seed=1)
    assert (0.83 if "KITTI" in kind else 0.86) <= found["gear"] <= 1.0, found


def test_ap_r40_of_few_labels_is_not_that_of_many() -> None:
    found = coverage(BY_NAME[AGAINST_ALL], samples=6, simulations=20, methods=("gear",), seed=1)
    assert found["gear"] < 0.8, "recalls that a class with few labels does not reach count as precision 0"


def test_without_a_correction_for_skewness_they_are_too_narrow() -> None:
    kind = BY_NAME["mean of a skewed error (skewness 3.7)"]
    found = coverage(kind, samples=6, simulations=3000, methods=("student", "gear"), seed=1)
    assert found["student"] < 0.885, found
    assert found["gear"] >= 0.915, "0.92, and a standard error of 0.005 of 3000 simulations"


def test_percentiles_of_a_bootstrap_do_not() -> None:
    found = coverage(BY_NAME["mIoU"], samples=5, simulations=100, methods=("percentile",), seed=1)
    assert found["percentile"] < 0.86, "resamples show fewer classes, and five pictures are few"


def test_replicates_that_are_not_finite_are_not_constant() -> None:
    assert not is_constant(np.array([np.inf, np.inf, np.inf]))
    assert not is_constant(np.array([np.nan, np.nan]))
    assert is_constant(np.array([0.5, 0.5, 0.5]))
