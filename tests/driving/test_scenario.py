from __future__ import annotations

from pathlib import Path

import pytest

from gear.driving.scenario import Lead, load_scenarios
from gear.values.errors import ConfigError, UnknownNameError


def test_the_standard_scenarios() -> None:
    scenarios = load_scenarios("standard").scenarios
    assert set(scenarios) == {
        "stopped_lead", "slower_lead", "cut_in", "crossing_pedestrian", "standing_pedestrian", "red_light",
        "free_road",
    }  # fmt: skip
    assert [name for name, one in scenarios.items() if one.is_free] == ["free_road"]
    assert all(one.summary for one in scenarios.values())
    assert scenarios["cut_in"].lead is not None and scenarios["cut_in"].lead.cut_in is not None


@pytest.mark.parametrize(
    ("text", "place", "problem"),
    [
        ("scenarios:\n  a: {speeds_kmh: [500]}\n", "2:19", "must be 5 to 130"),
        ("scenarios:\n  a:\n    leed: {}\n", "3:5", "lead"),
        ("scenarios:\n  a: {walker: {pace_mps: 9}}\n", "2:26", "must be 0 to 5 m/s"),
        ("scenarios:\n  a: {lead: {}, walker: {}}\n", "2:", "not both"),
        ("scenarios:\n  a: {lead: {cut_in: {takes_s: 0}}}\n", "2:", "0.2 to 10 s"),
        ("scenarios: {}\n", "1:", "no scenario"),
    ],
)
def test_errors_name_file_line_and_column(text: str, place: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_scenarios(str(path))
    assert str(caught.value).startswith(f"{path}:{place}") and problem in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_library_is_one_line() -> None:
    with pytest.raises(UnknownNameError, match="standard"):
        load_scenarios("standart")


def test_the_speed_of_the_lead() -> None:
    assert Lead().speed_mps(10.0) == 0.0
    assert Lead(speed_kmh=18.0).speed_mps(10.0) == pytest.approx(5.0)
    assert Lead(speed_share=0.5).speed_mps(10.0) == pytest.approx(5.0)
    assert Lead(speed_kmh=90.0).speed_mps(10.0) == 10.0, "it is never faster than the ego car"
