"""Samples of one street are left out, and the signs of their differences flipped, together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from gear.measuring.intervals import LEFT_OUT, jackknife_interval, leave_one_out
from gear.measuring.statistics import (
    ROUNDING,
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
    assert auroc_interval(values, low, clusters) == jackknife_interval(auroc(values, low), np.array(by_hand), (0, 1))


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
