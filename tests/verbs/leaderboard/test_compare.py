"""Comparison of a record with samples that were measured again, without a benchmark behind it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from gear.leaderboard.record import Record
from gear.leaderboard.verdict import Finding
from gear.verbs.leaderboard import compare
from gear.verbs.leaderboard.compare import (
    compare_fresh,
    compare_repeated,
    compare_withheld,
    is_same_machine,
    permutation_p,
)
from gear.verbs.leaderboard.rerun import Again
from tests.leaderboard.conftest import SAMPLES, record, sha


def again(one: Record, patch: str = "patch", index: int = 0, **changes: object) -> Again:
    """The sample of a record as an honest check finds it."""
    number = one.kinds().index(patch)
    claimed = next(sample for sample in one.samples if (sample.data, sample.index) == (number, index))
    same = Again(
        patch=patch, place=0, index=index, content_key=one.data[number].content_key, sha256=claimed.sha256,
        value=claimed.value, score=claimed.score,
    )  # fmt: skip
    return replace(same, **changes)  # type: ignore[arg-type]


def levels(found: Iterable[Finding]) -> set[str]:
    return {one.level for one in found}


def test_equal_samples_are_the_same() -> None:
    one = record()
    assert levels(compare_repeated(one, [again(one), again(one, index=1)], is_same=True)) == {"same"}


def test_bytes_decide_on_the_same_machine_and_tolerances_elsewhere() -> None:
    one = record()
    near = [again(one, index=i, sha256=sha("other"), value=0.51) for i in range(2)]
    assert "differs" in levels(compare_repeated(one, near, is_same=True))
    assert levels(compare_repeated(one, near, is_same=False)) == {"same", "note"}
    far = [again(one, index=i, sha256=sha("other"), value=0.54) for i in range(2)]
    assert "differs" in levels(compare_repeated(one, far, is_same=False)), "the mean is off by more than 0.02"
    assert "differs" in levels(compare_repeated(one, [again(one, value=None)], is_same=False))
    assert "differs" in levels(compare_repeated(one, [again(one, content_key=sha("x"))], is_same=True))


def test_which_machines_are_the_same() -> None:
    one = record(environment={"torch": "2.0", "renderer.device": "a", "python": "3.11"})
    assert is_same_machine(one, {"torch": "2.0", "renderer.device": "a", "python": "3.13"})
    assert not is_same_machine(one, {"torch": "2.0", "renderer.device": "b"})


def long_record(value: float) -> Record:
    """A record with more samples, all of which have about the same metric."""
    one = record()
    noise = np.random.default_rng(0).normal(0, 0.01, 12)
    data = tuple(replace(row, samples=12) for row in one.data)
    figures = tuple(replace(figure, n=12) for figure in one.results)
    samples = tuple(
        replace(one.samples[0], data=number, index=index, value=value + noise[index])
        for number in range(len(data)) for index in range(12)
    )  # fmt: skip
    return replace(one, data=data, results=figures, samples=samples)


@pytest.mark.parametrize(("value", "is_seen"), [(0.4, True), (0.6, False), (0.8, False)])
def test_a_defense_that_knows_the_benchmark_does_worse_on_other_pictures(value: float, is_seen: bool) -> None:
    one = long_record(0.6)
    noise = np.random.default_rng(1).normal(0, 0.01, 8)
    fresh = [replace(again(one), index=index, value=value + noise[index]) for index in range(8)]
    assert ("differs" in levels(compare_fresh(one, fresh, 0))) == is_seen


def test_many_tests_raise_no_more_alarms(monkeypatch: pytest.MonkeyPatch) -> None:
    one = long_record(0.6)
    fresh = [replace(again(one, patch), index=index) for patch in one.kinds() for index in range(8)]
    for p, seen in ((0.0024, 4), (0.0026, 0)):
        monkeypatch.setattr(compare, "permutation_p", lambda *_, p=p: p)
        found = list(compare_fresh(one, fresh, 0))
        assert len(found) == 4 and sum(each.level == "differs" for each in found) == seen


def test_means_of_large_values_are_compared_relatively() -> None:
    one = record()
    large = replace(one, samples=tuple(replace(each, value=40.0) for each in one.samples))
    for value, level in ((40.5, "same"), (41.0, "differs")):
        found = list(compare_repeated(large, [again(large, index=i, value=value) for i in range(2)], is_same=False))
        assert [each.level for each in found if "mean miou" in each.text] == [level]


def test_the_permutation_test_bounds_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    new, old = [0.1 * i for i in range(9)], [0.1 * i + 0.3 for i in range(11)]
    whole = permutation_p(new, old, 0)
    monkeypatch.setattr(compare, "MOST_NUMBERS", 100 * 20)
    assert permutation_p(new, old, 0) == pytest.approx(whole, abs=0.02)
    monkeypatch.setattr(compare, "MOST_NUMBERS", 3)
    assert permutation_p([1.0] * 5, [1.0] * 5, 0) == 1.0


def test_permutation_p_of_known_cases() -> None:
    assert permutation_p([0.0] * 5, [1.0] * 5, 0) < 0.02
    assert permutation_p([1.0] * 5, [1.0] * 5, 0) == 1.0
    assert permutation_p([1.0] * 5, [0.0] * 5, 0) > 0.9


def test_a_gain_that_turns_into_a_loss_in_withheld_scenes_is_seen() -> None:
    one = record()  # claims 0.60 with a patch, where the network alone has 0.30
    defended = [again(one, index=i % SAMPLES, value=0.3 - 0.001 * i) for i in range(10)]
    alone = [again(one, index=i % SAMPLES, value=0.5) for i in range(10)]
    assert levels(compare_withheld(one, defended, alone, 0)) == {"differs"}
    assert levels(compare_withheld(one, alone, defended, 0)) == {"note"}
