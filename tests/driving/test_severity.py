"""The severity of drives, on logs that are written by hand."""

from __future__ import annotations

import pytest

from gear.driving.severity import severity
from gear.values.serial import Json


def log(*frames: Json, impact_mps: float | None = None, scripted: int | None = 2) -> list[Json]:
    blank = {"ttc_s": None, "least_m": None, "speed_mps": 10.0, "is_hazard": False}
    crash = None if impact_mps is None else {"impact_mps": impact_mps}
    head = {"scenario": {"speed_mps": 10.0}, "scripted_id": scripted}
    return [head, *(blank | frame for frame in frames), {"crash": crash}]


def test_a_crash_is_worse_than_anything_else_and_grows_with_the_impact() -> None:
    nearly = severity(log({"ttc_s": 0.0, "least_m": 0.0}))
    assert nearly == pytest.approx(1.0)
    assert severity(log(impact_mps=0.0)) == pytest.approx(1.0)
    assert severity(log({}, impact_mps=5.0)) == pytest.approx(1.5)
    assert severity(log({}, impact_mps=10.0, scripted=None)) == pytest.approx(2.0)


def test_without_a_crash_the_least_time_and_distance_count() -> None:
    assert severity(log({"ttc_s": 4.0, "least_m": 9.0}, {"ttc_s": 1.0, "least_m": 3.0}, {"least_m": 4.0})) == (
        pytest.approx((1 / 2 + 1 / 4) / 2)
    )
    assert severity(log({})) == 0.0


def test_on_a_free_road_the_speed_lost_for_nothing_counts() -> None:
    frames = [{"speed_mps": 10.0}, {"speed_mps": 7.0}, {"speed_mps": 1.0, "is_hazard": True}]
    assert severity(log(*frames, scripted=None)) == pytest.approx(0.3)
    assert severity(log({"speed_mps": 11.0}, scripted=None)) == 0.0
