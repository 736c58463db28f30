"""The paired test of twins: exact where it can be, of the right size under the null, and as another library has it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest, norm, permutation_test

from gear.measuring.statistics import FLIPS, paired_p
from gear.values.rng import derive_rng


def column(*values: float) -> np.ndarray:
    return np.array(values, np.float64)[:, None]


def test_few_pairs_are_exact() -> None:
    assert paired_p(column(1, 2, 3), 0) == pytest.approx(2 / 8), "only +++ and --- are as far from 0 as 6"
    assert paired_p(column(1, -1), 0) == 1
    assert paired_p(column(1, 1, 1, -1), 0) == pytest.approx(10 / 16), "all but the six that sum to 0"
    assert paired_p(column(0, 0, 0), 0) == 1
    assert paired_p(column(*[0.1] * 13), 0) == pytest.approx(2 / 2**13)
    assert paired_p(column(0.1, 0.2, 0.3), 0) == paired_p(column(-0.1, -0.2, -0.3), 0), "two-sided"


def test_samples_without_a_value_do_not_count() -> None:
    nan = np.nan
    table = np.array([[1, nan, nan], [2, 1, nan], [3, 2, nan], [nan, 3, nan]])
    found = paired_p(table, 0)
    assert found[:2].tolist() == [0.25, 0.25] and np.isnan(found[2])


def test_few_pairs_are_exact_among_many_samples_too() -> None:
    """A class that few pictures show, and a metric of all of them beside it."""
    table = np.full((30, 3), np.nan)
    table[[2, 11, 29], 0] = 1, 2, 3
    table[:14, 1] = table[:, 2] = 0.1
    found = paired_p(table, 0)
    assert found[0] == 2 / 8, "3 pairs have 8 patterns, however many samples lack the metric"
    assert found[1] < 0.002 and found[2] == 1 / (FLIPS + 1), "14 and 30 pairs are drawn, as they were"


@pytest.mark.parametrize("count", [9, 40])
def test_it_agrees_with_scipy(count: int) -> None:
    values = derive_rng(1, "shifted", count).normal(0.3, 1, count)
    other = permutation_test(
        (values,), np.mean, permutation_type="samples", n_resamples=FLIPS, vectorized=True, random_state=3
    )
    assert paired_p(values[:, None], 7)[0] == pytest.approx(other.pvalue, abs=1e-12 if count == 9 else 0.02)


def test_many_pairs_follow_the_normal_law() -> None:
    signs = np.where(np.arange(400) % 2, 1.0, -1.0)
    signs[:36:2] = 1.0  # 18 of 400 turned round: a sum of 36 at a standard deviation of 20
    found = paired_p(signs[:, None], 0)[0]
    assert found == pytest.approx(2 * norm.sf(35 / 20), abs=0.012), "35, for the sums are even"
    assert paired_p(np.ones((400, 1)), 0)[0] == 1 / (FLIPS + 1), "never 0"


@pytest.mark.parametrize("count", [12, 30])
def test_p_is_uniform_where_nothing_differs(count: int) -> None:
    rng = derive_rng(5, "null", count)
    found = paired_p(rng.standard_t(3, (count, 3000)), 11)
    assert kstest(found, "uniform").pvalue > 0.01
    assert np.mean(found < 0.05) == pytest.approx(0.05, abs=0.013)


def test_the_seed_decides() -> None:
    values = derive_rng(2, "values").normal(0.2, 1, (30, 1))
    assert paired_p(values, 1) == paired_p(values, 1) != paired_p(values, 2)
