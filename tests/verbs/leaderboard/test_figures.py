"""Ranked figures of a record against figures that are computed again, without a benchmark behind them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from gear.leaderboard.record import Figure, Record
from gear.verbs.leaderboard.figures import Compared, compare_figures, compare_reference
from gear.verbs.leaderboard.rerun import Again
from tests.leaderboard.conftest import SAMPLES, record, sha

Ranked = Callable[[Sequence[Again]], float | None]
SPREAD = (-0.02, -0.01, 0.01, 0.02)
"""Differences of four samples from their mean."""


def mean(again: Sequence[Again]) -> float | None:
    return float(np.mean([one.value for one in again if one.value is not None]))


def pooled(again: Sequence[Again]) -> float | None:
    """A metric of all samples together that is no mean of the samples' values."""
    found = mean(again)
    return None if found is None else found - 0.1


def honest(shift: float = 0.0) -> Record:
    """A record whose figures are the means of its samples' values, plus a shift."""
    one = record()
    values = {figure.patch: figure.value for figure in one.results}
    samples = tuple(
        replace(each, value=(values[one.data[each.data].patch] or 0.0) + SPREAD[each.index]) for each in one.samples
    )
    return replace(one, samples=samples, results=tuple(shifted(figure, shift) for figure in one.results))


def shifted(figure: Figure, shift: float) -> Figure:
    value = (figure.value or 0.0) + shift
    return replace(figure, value=value, low=value, high=value)


def again(one: Record, count: int = SAMPLES) -> list[Again]:
    """The first samples of every kind as an honest check finds them."""
    return [
        Again(patch=one.data[each.data].patch, place=0, index=each.index, content_key=sha("x"), sha256=each.sha256,
              value=each.value, score=None)
        for each in one.samples if each.index < count
    ]  # fmt: skip


def levels(found: Compared) -> set[str]:
    return {one.level for one in found.findings}


@pytest.mark.parametrize(
    ("ranked", "shift", "count"), [(mean, 0.0, 1), (mean, 0.0, SAMPLES), (pooled, -0.1, SAMPLES), (mean, 0.01, SAMPLES)]
)
def test_honest_figures_are_the_same(ranked: Ranked, shift: float, count: int) -> None:
    found = compare_figures(honest(shift), again(honest(), count), ranked, is_same=False)
    assert levels(found) == {"same"} and found.is_whole and len(found.findings) == 4


@pytest.mark.parametrize(("ranked", "count"), [(mean, 1), (mean, SAMPLES), (pooled, SAMPLES)])
def test_a_figure_that_the_samples_do_not_give_differs(ranked: Ranked, count: int) -> None:
    found = compare_figures(honest(0.35), again(honest(), count), ranked, is_same=False)
    assert levels(found) == {"differs"}


def test_equal_predictions_on_the_same_machine_give_equal_figures() -> None:
    slightly = honest(0.01)
    assert levels(compare_figures(slightly, again(honest()), mean, is_same=True)) == {"differs"}
    assert levels(compare_figures(honest(), again(honest()), mean, is_same=True)) == {"same"}
    other = [replace(one, sha256=sha("other")) for one in again(honest())]
    assert levels(compare_figures(slightly, other, mean, is_same=True)) == {"same"}


def test_a_figure_of_the_whole_dataset_needs_all_samples() -> None:
    found = compare_figures(honest(0.35), again(honest(), SAMPLES - 1), pooled, is_same=False)
    assert not found.is_whole and levels(found) == {"note"}
    assert "none: miou was not computed again: it needs all 4 samples, 3 were measured" in found.findings[0].text


def test_values_of_another_metric_say_nothing_about_the_figure() -> None:
    found = compare_figures(replace(honest(0.35), sample_metric="nonsense"), again(honest(), 2), mean, is_same=False)
    assert not found.is_whole and "same" not in levels(found)


def test_a_record_without_values_is_not_reproduced() -> None:
    empty = replace(honest(), samples=tuple(replace(one, value=None) for one in honest().samples))
    assert not compare_figures(empty, again(empty, 2), lambda _: None, is_same=False).is_whole
    assert levels(compare_figures(empty, again(empty), lambda _: None, is_same=False)) == {"differs"}, (
        "it claims figures"
    )


def test_a_kind_of_patch_that_the_config_does_not_make_differs() -> None:
    one = honest()
    seen = [each for each in again(one) if each.patch != "adaptive patch"]
    assert "differs" in levels(compare_figures(one, seen, mean, is_same=False))
    named = {"patch": "patch of other"}
    transfer = replace(
        one,
        data=tuple(replace(each, patch=named.get(each.patch, each.patch)) for each in one.data),
        results=tuple(replace(each, patch=named.get(each.patch, each.patch)) for each in one.results),
    )
    found = compare_figures(transfer, [each for each in again(one) if each.patch != "patch"], mean, is_same=False)
    assert found.is_whole and levels(found) == {"same", "note"}


def test_figures_without_the_defense_are_compared_if_all_samples_are_there() -> None:
    one = record()
    values = {figure.patch: figure.value for figure in one.reference}
    alone = [replace(each, value=values[each.patch]) for each in again(one) if each.patch in values]
    assert [each.level for each in compare_reference(one, alone, mean)] == ["same"] * 3
    forged = replace(one, reference=tuple(shifted(figure, -0.05) for figure in one.reference))
    assert [each.level for each in compare_reference(forged, alone, mean)] == ["differs"] * 3
    assert [each.level for each in compare_reference(one, [], mean)] == ["note"]
    network = record(entry={"kind": "model", "defense": None, "gradient": None}, reference=())
    assert not list(compare_reference(network, [], mean))
