"""Weights of the networks of an ensemble."""

from __future__ import annotations

import math

import pytest
import torch

from gear.contracts.attacks import Term
from gear.plugins.attacks.optimisation.member_weights import balanced, member_factors


def test_the_least_harmed_network_counts_most() -> None:
    low, high = member_factors([1.0, 3.0], 2.0)
    assert low / high == pytest.approx(math.exp(2.0 * (3.0 - 1.0) / 2.0)) and low + high == pytest.approx(2.0)
    assert member_factors([1.0, 1.0, 1.0], 5.0) == pytest.approx([1.0, 1.0, 1.0])
    assert member_factors([-3.0, -1.0], 2.0)[0] > 1, "objectives may be negative"
    assert member_factors([10.0, 30.0], 2.0) == pytest.approx(member_factors([1.0, 3.0], 2.0)), "in any unit"


@pytest.mark.parametrize("harms", [[], [4.0], [0.0, 0.0], [math.nan, 1.0], [math.inf, 1.0]])
def test_where_nothing_can_be_preferred_all_count_alike(harms: list[float]) -> None:
    assert member_factors(harms, 3.0) == [1.0] * len(harms)
    assert member_factors([1.0, 9.0], 0.0) == [1.0, 1.0]


def test_extreme_harms_have_finite_factors() -> None:
    found = member_factors([1e30, 1.0, -1e30], 100.0)
    assert all(math.isfinite(one) for one in found) and sum(found) == pytest.approx(3.0)


def test_terms_keep_their_values_and_signs() -> None:
    first = {"a": Term(value=torch.tensor(2.0), weight=0.5), "b": Term(value=torch.tensor(1.0), weight=-1.0)}
    second = {"a": Term(value=torch.tensor(4.0), weight=1.0)}
    found = balanced({"one/": first, "two/": second, "three/": {}}, 1.0)
    low, high = member_factors([0.0, 4.0], 1.0)
    assert {name: term.weight for name, term in found.items()} == pytest.approx(
        {"one/a": 0.5 * low, "one/b": -low, "two/a": high}
    )
    assert found["one/a"].value is first["a"].value
    assert balanced({"": first}, 9.0) == first, "a single network has no other"
