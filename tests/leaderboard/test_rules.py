"""The rules of the leaderboard, one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gear.leaderboard.rules import clean_loss, faults, warnings
from tests.leaderboard.conftest import VALUES, attacking, benchmark, figures, plugin, record


def without(kind: str) -> dict[str, float]:
    return {name: value for name, value in VALUES.items() if name != kind}


def test_a_complete_row_has_no_faults_and_no_flags() -> None:
    assert faults([record()]) == [] and warnings([record()]) == []


@pytest.mark.parametrize(
    ("values", "changes", "fault"),
    [
        (without("none"), {}, "without a patch"),
        (without("random"), {}, "random patches"),
        (without("patch"), {}, "optimised patches"),
        (without("adaptive patch"), {}, "not attacked adaptively"),
        (VALUES, {"entry": {"gradient": "none"}}, "counts queries"),
        (VALUES, {"entry": {"is_random": True}}, "3 seeds are needed, there are 1"),
        ({**VALUES, "none": 0.68}, {}, "loses 3.0 points"),
        (VALUES, {"reference": ()}, "without the defense are missing"),
    ],
)
def test_each_rule(values: dict[str, float], changes: dict[str, Any], fault: str) -> None:
    assert any(fault in line for line in faults([record(values, **changes)]))


def test_a_random_defense_needs_three_seeds() -> None:
    seeds = [record(entry={"is_random": True}, benchmark=benchmark(seed=seed)) for seed in range(3)]
    assert faults(seeds) == [] and faults(seeds[:2])


def test_a_query_attack_suffices_without_a_gradient() -> None:
    black = {"knowledge": "black-box", "steps": 0, "queries": 500}
    assert faults([record(entry={"gradient": "none"}, attack=black)]) == []


def test_the_clean_loss_of_an_error_is_relative() -> None:
    less = record(
        {"none": 5.05, "random": 5.1, "patch": 6.0, "adaptive patch": 7.0},
        reference=figures({"none": 5.0}), entry={"lower_is_better": True},
    )  # fmt: skip
    assert clean_loss(less) == pytest.approx(0.01)
    assert warnings([less]) == []


def test_flags_within_a_record() -> None:
    assert any("not clearly worse than random" in line for line in warnings([record({**VALUES, "patch": 0.69})]))
    lines = warnings([record({**VALUES, "adaptive patch": 0.61})])
    assert any("no worse than patches made without knowledge" in line for line in lines)
    one = record()
    weak = replace(one, patches=(replace(one.patches[0], gain=-0.1, gradient_kept=0.2),))
    assert [line.split(",")[0] for line in warnings([weak])] == [
        "the objective follows its gradient only in part (0.20)",
        "the attack did not raise its objective over random patches in town10-billboard01",
    ]


@pytest.mark.parametrize(("adaptive", "is_flagged"), [(0.50, False), (0.46, False), (0.44, True), (0.20, True)])
def test_a_defense_that_survives_only_static_attacks_is_flagged(adaptive: float, is_flagged: bool) -> None:
    """The defense lifts 0.30 to 0.60 under static patches; half of that gain remains at 0.45."""
    lines = warnings([record({**VALUES, "adaptive patch": adaptive})])
    assert any("survives only static attacks" in line for line in lines) is is_flagged


def test_errors_survive_only_static_attacks_in_their_direction() -> None:
    values = {"none": 5.0, "random": 5.1, "patch": 6.0, "adaptive patch": 7.8}
    worse = record(
        values, reference=figures({"none": 5.0, "patch": 8.0}), entry={"lower_is_better": True}
    )  # fmt: skip
    assert any("survives only static attacks" in line for line in warnings([worse]))
    alone = record(values, reference=figures({"none": 5.0}), entry={"lower_is_better": True})
    assert not any("survives only" in line for line in warnings([alone])), "the network alone was not attacked"


def test_a_black_box_attack_that_beats_white_box_is_flagged() -> None:
    black = {"knowledge": "black-box", "steps": 0, "queries": 500}
    assert any("black-box" in line for line in warnings([record()], [attacking(record(), 0.2, **black)]))
    assert warnings([record()], [attacking(record(), 0.58, **black)]) == []


def test_more_steps_that_do_not_help_are_flagged() -> None:
    same = plugin("eot")
    more = attacking(record(), 0.6, plugin=same, steps=400)
    assert any("400 steps of eot harm no more than 100" in line for line in warnings([record()], [more]))
    helped = attacking(record(), 0.1, plugin=same, steps=400)
    assert not any("harm no more" in line for line in warnings([record()], [helped]))
