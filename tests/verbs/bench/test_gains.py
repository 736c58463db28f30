"""Gains and costs of a defense against the network without it."""

from __future__ import annotations

import pytest

from gear.verbs.bench.gains import against_clean, alone, gain, is_failed
from gear.verbs.evaluate.report import Estimate
from tests.verbs.bench.synthetic import task


def value(one: Estimate | None) -> float:
    assert one is not None
    return one.value


def test_gains_are_against_the_network_alone_and_not_behind_the_defense() -> None:
    every = task()
    bare, cleaner, _ = every.results
    assert alone(every, cleaner) is bare
    assert value(gain(every, cleaner, cleaner.pool("patch"))) == pytest.approx(0.05)
    assert value(gain(every, cleaner, cleaner.pool("none"))) == pytest.approx(-0.01), "what the defense costs"
    assert value(gain(every, cleaner, cleaner.pool("adaptive patch"))) == pytest.approx(-0.05)
    assert value(against_clean(every, cleaner, cleaner.pool("patch"))) == pytest.approx(0.50 - 0.65)
    assert value(against_clean(every, bare, bare.pool("patch"))) == pytest.approx(0.45 - 0.65)
    assert gain(every, bare, bare.pool("patch")) is None
    assert against_clean(every, bare, bare.pool("none")) is None


def test_intervals_are_those_of_paired_differences() -> None:
    every = task()
    _, cleaner, _ = every.results
    found = gain(every, cleaner, cleaner.pool("patch"))
    assert found is not None and found.interval is not None
    assert found.interval == pytest.approx((0.05, 0.05)), "what both share cancels out"


def test_failed_attacks() -> None:
    every = task()
    bare = every.results[0]
    assert not is_failed(every, bare, bare.pool("patch"))
    assert not is_failed(every, bare, bare.pool("random")) and not is_failed(every, bare, bare.pool("none"))
    chance = task(p=0.3)
    assert is_failed(chance, chance.results[0], chance.results[0].pool("patch"))
