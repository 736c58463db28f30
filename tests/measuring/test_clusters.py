"""Samples of one street are left out, and the signs of their differences flipped, together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from gear.measuring.intervals import LEFT_OUT, jackknife_interval, leave_one_out
from gear.measuring.statistics import (
    ROUNDING,
    Metrics,
    auroc,
    auroc_interval,
    clustered,
    difference_interval,
    gather,
    paired_p,
)
from gear.values.rng import derive_rng


class Mean:
    """Of the numbers that it has seen; merging is all that it can."""

    def __init__(self, *values: float) -> None:
        self.values = list(values)

    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        raise NotImplementedError

    def merge(self, other: Any) -> None:
        self.values += other.values

    def result(self) -> Mapping[str, float]:
        return {"mean": float(np.mean(self.values)) if self.values else float("nan")}


class Quick(Mean):
    """The same, with a quicker way over as many samples in each draw."""

    def resampled(self, draws: Any) -> Mapping[str, Any]:
        assert draws.min() >= 0
        return {"mean": np.array(self.values)[draws].mean(axis=1)}


class Summed(Mean):
    """The same, by sums."""

    def totals(self) -> Mapping[str, Any]:
        return {"sum": np.array(sum(self.values)), "count": np.array(len(self.values))}

    def metrics(self, totals: Mapping[str, Any]) -> Mapping[str, Any]:
        return {"mean": totals["sum"] / totals["count"]}


def test_clusters_of_one_sample_each_change_no_test() -> None:
    values = derive_rng(0, "alone").normal(0.3, 1, (30, 2))
    values[::4, 1] = np.nan
    assert np.array_equal(paired_p(clustered(values, range(30)), 5), paired_p(values, 5))


def test_a_cluster_is_left_out_whole() -> None:
    rows = leave_one_out([*range(5), *range(5)])
    assert rows.shape == (5, 10)
    for number, row in enumerate(rows):
        assert set(range(10)) - set(row) == {number, number + 5}


@pytest.mark.parametrize("metric", [Mean, Quick, Summed])
def test_clusters_of_several_sizes(metric: type[Mean]) -> None:
    """Without a cluster more or fewer samples are left, and each replicate is what these come to."""
    clusters, values = [0, 1, 2, 0, 1, 3], [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
    draws = leave_one_out(clusters)
    found = gather(metric, [metric(value) for value in values], draws)
    wanted = [np.mean([value for one, value in zip(clusters, values, strict=True) if one != c]) for c in range(4)]
    assert found.replicates["mean"] == pytest.approx(wanted) and (draws == LEFT_OUT).any()
    assert found.interval("mean") == jackknife_interval(found.overall["mean"], found.replicates["mean"])
    low = [value - 3 for value in values[::-1]]
    by_hand = [auroc(*(np.take(one, row[row != LEFT_OUT]) for one in (values, low))) for row in draws]
    assert auroc_interval(values, low, clusters) == jackknife_interval(
        auroc(values, low), np.array(by_hand), (0, 1), lost_degrees=1
    )


def test_what_is_said_twice_is_no_surer() -> None:
    values = derive_rng(1, "twice").normal(1, 1, 12)
    once = gather(Quick, [Quick(value) for value in values], leave_one_out(range(12)))
    twice = gather(Quick, [Quick(value) for value in (*values, *values)], leave_one_out([*range(12)] * 2))
    assert twice.interval("mean") == pytest.approx(once.interval("mean"))
    column = values[:, None]
    p = paired_p(clustered(np.concatenate([column, column]), [*range(12)] * 2), 2)
    assert p == paired_p(column, 2) > 2 * paired_p(np.concatenate([column, column]), 2)


def test_a_difference_is_paired() -> None:
    """Twins that vary together differ by less than either varies."""
    values = derive_rng(2, "paired").normal(1, 1, 12)
    one, other = (
        gather(Quick, [Quick(value) for value in side], leave_one_out(range(12))) for side in (values, values + 0.5)
    )
    assert difference_interval(other, one, "mean") == pytest.approx((0.5, 0.5))
    assert difference_interval(other, one, "no such metric") is None


def test_unknown_differences_of_a_cluster_do_not_count() -> None:
    nan = np.nan
    table = np.array([[1.0, nan, 0.1], [2.0, nan, 1.0], [nan, nan, 0.2], [5.0, 3.0, 1.0], [nan, nan, -0.3]])
    sums = clustered(table, ["a", "b", "a", "b", "a"])
    assert np.array_equal(sums[:, :2], [[1, nan], [7, 3]], equal_nan=True)
    assert sums[:, 2].tolist() == [0, 2], f"0.1 + 0.2 - 0.3 is 0 but for a share of less than {ROUNDING}"


class Found(Summed):
    """The share of objects that are found; a sample without objects (NaN) adds nothing."""

    def totals(self) -> Mapping[str, Any]:
        known = np.isfinite(self.values)
        return {"sum": np.nansum(self.values), "count": known.sum()}

    def metrics(self, totals: Mapping[str, Any]) -> Mapping[str, Any]:
        with np.errstate(invalid="ignore"):
            return {"share": np.asarray(totals["sum"] / totals["count"])}

    def result(self) -> Mapping[str, float]:
        return {name: float(value) for name, value in self.metrics(self.totals()).items()}

    def range_of(self, metric: str) -> tuple[float, float]:
        return 0.0, 1.0


def shares(*values: float, clusters: list[int] | None = None) -> Metrics:
    return gather(Found, [Found(value) for value in values], leave_one_out(clusters or range(len(values))))


@pytest.mark.parametrize("value", [0.0, 1.0])
def test_a_share_at_its_limit_rests_on_the_streets_that_show_it(value: float) -> None:
    """Five streets show an object, two of them in two samples each, and three streets show none."""
    nan = math.nan
    found = shares(value, value, value, value, value, value, value, nan, nan, nan, clusters=[0, 0, 1, 1, *range(2, 8)])
    exact = binomtest(int(5 * value), 5).proportion_ci(0.95, method="exact")
    assert found.support == {"share": 5}
    assert found.interval("share") == pytest.approx((exact.low, exact.high))


def test_only_shares_at_their_limits_have_a_support() -> None:
    assert shares(0.5, 0.5, 0.5).support == {} and shares(0.5, 0.5, 0.5).interval("share") == (0.5, 0.5)
    assert shares(1.0, 1.0, 0.9).support == {} and shares(1.0).support == {}
    assert shares(1.0).interval("share") is None


def test_a_difference_of_a_share_at_its_limit_is_combined_from_both() -> None:
    clean, patched = shares(1.0, 0.8, 0.9, 1.0, 0.7), shares(0.0, 0.0, 0.0, 0.0, 0.0)
    low, high = difference_interval(patched, clean, "share") or (0, 0)
    clean_low, clean_high = clean.interval("share") or (0, 0)
    _, patched_high = patched.interval("share") or (0, 0)
    assert low == pytest.approx(-0.88 - (clean_high - 0.88)), "nothing is below a share of 0"
    assert high == pytest.approx(-0.88 + math.hypot(patched_high, 0.88 - clean_low)) and low < -0.88 < high
    both = difference_interval(shares(*[1.0] * 8), shares(*[1.0] * 8), "share") or (0, 0)
    assert both == pytest.approx((-0.369, 0.369), abs=1e-3), "2.5 % of eight trials that all succeed"


class Alarms(Summed):
    """False alarms per picture."""

    def range_of(self, metric: str) -> tuple[float, float]:
        return 0.0, math.inf

    def counted(self) -> frozenset[str]:
        return frozenset({"mean"})


class Errors(Summed):
    """Errors in metres."""

    def range_of(self, metric: str) -> tuple[float, float]:
        return 0.0, math.inf


def test_no_event_in_ten_streets_has_the_interval_of_a_poisson_mean() -> None:
    silent = gather(Alarms, [Alarms(0.0) for _ in range(10)], leave_one_out(range(10)))
    low, high = silent.interval("mean") or (1, 1)
    assert low == 0 and math.exp(-10 * high) == pytest.approx(0.025)
    loud = gather(Alarms, [Alarms(1.0) for _ in range(10)], leave_one_out(range(10)))
    assert loud.interval("mean") == (1, 1), "each picture has one"


def test_an_error_of_nothing_has_no_interval() -> None:
    found = gather(Errors, [Errors(0.0) for _ in range(10)], leave_one_out(range(10)))
    assert found.interval("mean") is None, "metres cannot be counted"
