"""Intervals of differences between drives cover a known truth."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from gear.driving.statistics import exact_p, mean_difference
from gear.measuring.intervals import REAL
from gear.values.rng import derive_rng

SIMULATIONS, SEEDS = 400, 3


@pytest.mark.parametrize("scenarios", [4, 10])
@pytest.mark.parametrize("kind", ["crashes", "normal delays", "skewed delays"])
def test_intervals_over_scenarios_cover_a_known_truth(kind: str, scenarios: int) -> None:
    """The lower bound is 92 %, and three standard errors of 400 simulations.

    There are three drives of each scenario. Crashes are compared between twins of equal probability, so the true
    difference is 0; the true mean delay is 1 s.
    """
    rng = derive_rng(0, kind, str(scenarios))
    limits, truth = ((-1.0, 1.0), 0.0) if kind == "crashes" else (REAL, 1.0)
    clusters = np.repeat(np.arange(scenarios), SEEDS).tolist()
    held = []
    for _ in range(SIMULATIONS):
        if kind == "crashes":
            one, other = (rng.random((scenarios, SEEDS)) < rng.beta(1, 2, (scenarios, 1)) for _ in range(2))
            values = one.astype(float) - other
        else:
            means = rng.normal(1, 1, scenarios) if kind == "normal delays" else rng.exponential(1, scenarios)
            values = means[:, None] + rng.normal(0, 0.5, (scenarios, SEEDS))
        _, interval = mean_difference(values.ravel().tolist(), clusters, limits)
        if interval is not None:  # else all scenarios are equal
            held.append(interval[0] <= truth <= interval[1])
    assert len(held) > 0.9 * SIMULATIONS
    assert np.mean(held) >= 0.92 - 3 * math.sqrt(0.92 * 0.08 / SIMULATIONS)


def test_scenarios_are_left_out_with_all_their_seeds() -> None:
    mean, interval = mean_difference([0.0, 0.0, 1.0, 1.0, None], ["a", "a", "b", "b", "c"])
    assert mean == 0.5 and interval is None, "two scenarios are too few"
    _, wide = mean_difference([0.0, 0.0, 1.0, 1.0, 2.0, 2.0], ["a", "a", "b", "b", "c", "c"])
    _, narrow = mean_difference([0.0, 0.0, 1.0, 1.0, 2.0, 2.0], list("abcdef"))
    assert wide is not None and narrow is not None and wide[1] - wide[0] > narrow[1] - narrow[0]


@pytest.mark.parametrize(("only_here", "only_there", "equal"), [(0, 0, 3), (7, 0, 2), (5, 2, 0), (3, 3, 1)])
def test_one_drive_per_situation_gives_mcnemars_exact_test(only_here: int, only_there: int, equal: int) -> None:
    differences = [1] * only_here + [-1] * only_there + [0] * equal
    unequal = only_here + only_there
    expected = stats.binomtest(only_here, unequal, 0.5).pvalue if unequal else 1.0
    assert exact_p(differences) == pytest.approx(expected, rel=1e-12)


def test_several_drives_per_situation_are_compared_by_all_choices_of_signs() -> None:
    differences = [3, -1, 2, 0, 2]
    sums = [sum(sign * one for sign, one in zip(signs, differences, strict=True))
            for signs in itertools.product((-1, 1), repeat=5)]  # fmt: skip
    assert exact_p(differences) == np.mean(np.abs(sums) >= 6)
    assert exact_p([4] * 5) == exact_p([1] * 5) and exact_p([]) == 1.0
