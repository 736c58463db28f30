"""Vehicle mixes: checks and products."""

from __future__ import annotations

import pytest

from gear.values.errors import FieldError
from gear.values.labels import VEHICLES
from gear.values.vehicle_mix import MAX_FACTOR, check_mix, product_of


@pytest.mark.parametrize(
    ("mix", "problem"),
    [
        ({"tank": 1.0}, "mix.tank: is no kind of vehicle"),
        ({"car": -0.1}, r"mix.car: must be 0 to 1000, got -0\.1"),
        ({"car": MAX_FACTOR * 2}, "mix.car: must be 0 to 1000"),
        ({"car": float("nan")}, "mix.car: must be 0 to 1000"),
        (dict.fromkeys(VEHICLES, 0.0), "mix: leaves no vehicle"),
    ],
)
def test_impossible_mixes_are_refused(mix: dict[str, float], problem: str) -> None:
    with pytest.raises(FieldError, match=problem):
        check_mix("mix", mix)


def test_a_mix_may_leave_kinds_out() -> None:
    check_mix("mix", {})
    check_mix("mix", {"car": 0.0, "bus": MAX_FACTOR})


def test_factors_of_two_mixes_are_multiplied() -> None:
    assert product_of({"car": 2.0, "bus": 0.5}, {"car": 3.0, "truck": 0.0}) == {"car": 6.0, "bus": 0.5, "truck": 0.0}
    assert product_of({}, {}) == {}
