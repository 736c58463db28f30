"""Gains and costs of a defense against the network without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gear.measuring.statistics import Metrics
from gear.verbs.bench.gains import against_clean, alone, gain, is_failed, survives_only_static
from gear.verbs.bench.report import Result, TaskResult
from gear.verbs.evaluate.report import Estimate
from tests.verbs.bench.synthetic import gathered, task


def estimated(value: float, interval: tuple[float, float] | None) -> Estimate:
    return Estimate(value=value, interval=interval)


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


def with_metric(one: Result, **values: float | Metrics) -> Result:
    """The results with other values of the metric, by kind of patch (`adaptive` for `adaptive patch`)."""
    pools = []
    for pool in one.evaluation.pools:
        new = values.get(pool.name.removesuffix(" patch"))
        if new is None:
            pools.append(pool)
            continue
        found = new if isinstance(new, Metrics) else gathered(new)["task"]
        metric = estimated(found.overall["miou"], None)
        pools.append(replace(pool, gathered={"task": found}, metrics={"task": {"miou": metric}}))
    return replace(one, evaluation=replace(one.evaluation, pools=tuple(pools)))


@pytest.mark.parametrize(
    ("static", "adaptive", "is_marked"),
    [
        (0.55, 0.46, True),  # a gain of 0.10, of which 0.01 remains
        (0.55, 0.40, True),  # worse than without the defense
        (0.55, 0.51, False),  # 0.06 of 0.10 remains
        (0.55, 0.60, False),
        (0.45, 0.30, False),  # no gain that could be lost
        (0.40, 0.30, False),
    ],
)
def test_defenses_that_survive_only_static_attacks(static: float, adaptive: float, is_marked: bool) -> None:
    """Without a defense, the network has 0.45 under patches."""
    every = task()
    cleaner = with_metric(every.results[1], patch=static, adaptive=adaptive)
    assert survives_only_static(every, cleaner) is is_marked
    assert not survives_only_static(every, every.results[0]), "there is no defense"


def test_the_mark_has_the_direction_of_an_error() -> None:
    every = task()
    assert every.metric is not None
    error = replace(every, metric=replace(every.metric, lower_is_better=True))
    assert survives_only_static(error, with_metric(error.results[1], patch=0.30, adaptive=0.44))
    assert not survives_only_static(error, with_metric(error.results[1], patch=0.30, adaptive=0.32))


def test_a_gain_that_may_be_chance_is_no_gain() -> None:
    """The streets disagree about the gain, so its interval contains 0."""
    every = task()
    noisy = Metrics(overall={"miou": 0.55}, replicates={"miou": 0.55 + np.array([0.4, -0.4] * 4)}, ceilings={})
    assert not survives_only_static(every, with_metric(every.results[1], patch=noisy, adaptive=0.40))


def with_auroc(every: TaskResult, static: Estimate, adaptive: Estimate) -> Result:
    """The cleaner without any gain, with a score."""
    one = with_metric(every.results[1], patch=0.45, adaptive=0.45)
    found = {"patch": static, "adaptive patch": adaptive}
    pools = tuple(
        replace(pool, differences=tuple(replace(each, auroc=found.get(pool.name)) for each in pool.differences))
        for pool in one.evaluation.pools
    )
    return replace(one, evaluation=replace(one.evaluation, pools=pools))


@pytest.mark.parametrize(
    ("static", "adaptive", "is_marked"),
    [
        (estimated(0.95, (0.9, 1.0)), estimated(0.55, (0.4, 0.7)), True),
        (estimated(0.95, (0.9, 1.0)), estimated(0.90, (0.8, 1.0)), False),
        (estimated(0.95, (0.4, 1.0)), estimated(0.55, (0.4, 0.7)), False),  # may be chance
        (estimated(0.95, (0.9, 1.0)), estimated(0.60, (0.1, 1.0)), False),  # the loss may be chance
        (estimated(0.95, None), estimated(0.60, None), True),
    ],
)
def test_detectors_that_survive_only_static_attacks(static: Estimate, adaptive: Estimate, is_marked: bool) -> None:
    every = task()
    assert survives_only_static(every, with_auroc(every, static, adaptive)) is is_marked
