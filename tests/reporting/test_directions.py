"""Names of curves with the direction that is better."""

from __future__ import annotations

from gear.reporting.directions import FOR_THE_ATTACK, with_direction


def test_a_name_states_its_direction() -> None:
    assert with_direction("miou", lower_is_better=False) == "miou (up is better)"
    assert with_direction("loss", lower_is_better=True) == "loss (down is better)"
    assert with_direction("miss", lower_is_better=False, whose=FOR_THE_ATTACK) == ("miss (up is better for the attack)")
    assert with_direction("learning rate", lower_is_better=None, whose=FOR_THE_ATTACK) == "learning rate"
