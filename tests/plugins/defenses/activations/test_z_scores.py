"""Means, deviations, levels and scores."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.plugins.defenses.activations.z_scores import (
    FLOOR,
    alarm_level,
    clean_statistics,
    false_alarm_interval,
    moments,
    normalised_score,
)
from gear.values.errors import GearError


@given(st.integers(0, 10_000), st.integers(2, 9), st.floats(-1e4, 1e4))
@settings(max_examples=40, deadline=None)
def test_one_pass_gives_what_numpy_gives_from_all(seed: int, count: int, offset: float) -> None:
    values = torch.randn(count, 2, 3, generator=torch.Generator().manual_seed(seed)) + offset
    statistics = clean_statistics(values)
    assert np.allclose(statistics.mean, values.double().numpy().mean(axis=0))
    assert np.allclose(statistics.deviation, values.double().numpy().std(axis=0, ddof=1), atol=1e-9)


def test_scores_count_deviations() -> None:
    statistics = clean_statistics([torch.tensor([0.0, 10.0]), torch.tensor([2.0, 14.0])])
    floor = FLOOR * float(statistics.deviation.mean())
    z = statistics.z_scores(torch.tensor([3.0, 10.0]))
    assert z.tolist() == pytest.approx([2 / (2**0.5 + floor), -2 / (8**0.5 + floor)])


def test_a_number_that_never_changed_does_not_outweigh_all_others() -> None:
    statistics = clean_statistics([torch.tensor([0.0, 10.0]), torch.tensor([0.0, 14.0])])
    assert float(statistics.z_scores(torch.tensor([0.01, 12.0])).abs().max()) < 1


def test_maps_of_another_size_are_refused_with_both() -> None:
    statistics = clean_statistics([torch.zeros(2, 3), torch.ones(2, 3)])
    with pytest.raises(GearError, match=r"2 x 4 numbers, and had 2 x 3 in calibration"):
        statistics.z_scores(torch.zeros(2, 4))
    with pytest.raises(GearError, match="one size"):
        clean_statistics([torch.zeros(2), torch.zeros(3)])
    with pytest.raises(GearError, match="at least two pictures"):
        clean_statistics([torch.zeros(2)])


def test_one_clean_picture_in_twenty_raises_the_alarm() -> None:
    scores = np.linspace(1, 2, 101).tolist()
    level = alarm_level(scores, 0.05)
    assert level == pytest.approx(1.96), "rank 97 of 102: new pictures count, too"
    assert sum(normalised_score(score, level) > 0.5 for score in scores) == 4, (
        "a new picture has five of 102 ranks above"
    )


def test_too_few_pictures_tell_no_level() -> None:
    with pytest.raises(GearError, match=r"18 clean calibration pictures are too few.*at least 19"):
        alarm_level([1.0] * 18, 0.05)
    assert alarm_level(list(range(19)), 0.05) == 18
    low, high = false_alarm_interval(40, 0.05)
    assert 0 < low < 0.05 < 0.12 < high, "forty pictures leave open whether one in eight raises the alarm"


def test_merged_moments_are_those_of_all() -> None:
    values = torch.randn(7, 3, generator=torch.Generator().manual_seed(1))
    merged = moments(values[:3]).merged(moments(values[3:])).clean_statistics()
    assert torch.allclose(merged.mean, values.double().mean(0))
    assert torch.allclose(merged.deviation, values.double().std(0))


@given(st.floats(0, 1e6), st.floats(0, 1e6), st.floats(0, 1e3))
def test_scores_keep_the_order_and_stay_in_0_to_1(one: float, other: float, level: float) -> None:
    low, high = sorted((one, other))
    assert 0 <= normalised_score(low, level) <= normalised_score(high, level) <= 1


def test_what_is_no_number_is_an_alarm() -> None:
    assert normalised_score(float("nan"), 1.0) == normalised_score(float("inf"), 1.0) == 1.0
