"""Samples of one street are drawn, and their differences flipped, together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from gear.measuring.statistics import (
    FILLED,
    ROUNDING,
    auroc,
    auroc_interval,
    bounds,
    clustered,
    draw,
    draw_clusters,
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


def test_samples_of_their_own_are_drawn_as_ever() -> None:
    assert np.array_equal(draw_clusters(list("abcdefg"), 50, 3), draw(7, 50, 3))
    assert draw_clusters(["a"], 50, 3).shape == (0, 1) and draw_clusters(["a", "a"], 50, 3).shape == (0, 2)
    values = derive_rng(0, "alone").normal(0.3, 1, (30, 2))
    values[::4, 1] = np.nan
    assert np.array_equal(paired_p(clustered(values, range(30)), 5), paired_p(values, 5))


def test_a_cluster_is_drawn_whole() -> None:
    draws = draw_clusters([*range(5), *range(5)], 40, 3)
    assert draws.shape == (40, 10)
    for row, chosen in zip(draws, draw(5, 40, 3), strict=True):
        assert sorted(row) == sorted([*chosen, *(chosen + 5)])


@pytest.mark.parametrize("metric", [Mean, Quick, Summed])
def test_clusters_of_several_sizes(metric: type[Mean]) -> None:
    """Draws come to more or fewer samples, and each is what its clusters come to."""
    clusters, values = [0, 1, 2, 0, 1, 3], [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]
    draws = draw_clusters(clusters, 60, 1)
    found = gather(metric, [metric(value) for value in values], draws).spread["mean"]
    members = {0: [1.0, 8.0], 1: [2.0, 16.0], 2: [4.0], 3: [32.0]}
    wanted = [np.mean([value for one in chosen for value in members[one]]) for chosen in draw(4, 60, 1)]
    assert found == pytest.approx(wanted) and (draws == FILLED).any()
    low = [value - 3 for value in values[::-1]]
    by_hand = [auroc(*(np.take(one, row[row != FILLED]) for one in (values, low))) for row in draws]
    assert auroc_interval(values, low, draws) == bounds(np.array(by_hand))


def test_what_is_said_twice_is_no_surer() -> None:
    values = derive_rng(1, "twice").normal(1, 1, 12)
    once = gather(Quick, [Quick(value) for value in values], draw_clusters(range(12), 500, 2))
    twice = gather(Quick, [Quick(value) for value in (*values, *values)], draw_clusters([*range(12)] * 2, 500, 2))
    assert twice.interval("mean") == pytest.approx(once.interval("mean"))
    column = values[:, None]
    p = paired_p(clustered(np.concatenate([column, column]), [*range(12)] * 2), 2)
    assert p == paired_p(column, 2) > 2 * paired_p(np.concatenate([column, column]), 2)


def test_unknown_differences_of_a_cluster_do_not_count() -> None:
    nan = np.nan
    table = np.array([[1.0, nan, 0.1], [2.0, nan, 1.0], [nan, nan, 0.2], [5.0, 3.0, 1.0], [nan, nan, -0.3]])
    sums = clustered(table, ["a", "b", "a", "b", "a"])
    assert np.array_equal(sums[:, :2], [[1, nan], [7, 3]], equal_nan=True)
    assert sums[:, 2].tolist() == [0, 2], f"0.1 + 0.2 - 0.3 is 0 but for a share of less than {ROUNDING}"
