"""The line chart of a sweep."""

from __future__ import annotations

from gear.verbs.bench.sweep_chart import Labelled, sweep_chart

POINTS: list[Labelled] = [
    ("net, random", "random", "10", 0.7, 0.0), ("net, random", "random", "50", 0.7, 0.0),
    ("net, patch", "patch", "10", 0.5, 0.02), ("net, patch", "patch", "50", 0.3, 0.01),
]  # fmt: skip


def test_numbers_are_to_scale_and_names_in_order() -> None:
    numbers = sweep_chart(POINTS, ("10", "50"), axes=("pictures", "miou"), form="svg")
    assert numbers == sweep_chart(POINTS, ("10", "50"), axes=("pictures", "miou"), form="svg")
    names = [(name, patch, f"[w{value}]", mean, std) for name, patch, value, mean, std in POINTS]
    assert sweep_chart(names, ("[w10]", "[w50]"), axes=("weather", "miou"), form="svg") != numbers


def test_a_chart_without_points_is_drawn() -> None:
    assert sweep_chart([], ("10",), axes=("pictures", "miou"), form="pdf").startswith(b"%PDF")
