"""Rates, intervals and paired tests on results that are written by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from gear.driving.drives import DriveRun
from gear.driving.measures import Measures
from gear.driving.statistics import Rate, compared, mean_difference
from gear.driving.worker import DriveResult
from gear.verbs.drive.page import page, table
from gear.verbs.drive.report import DriveReport
from gear.verbs.drive.table import DEFINITIONS, cells, paired_cells, rate, speed_cells, text

MEASURES = Measures(
    ending="time",
    is_crash=False,
    crash_kind="",
    impact_mps=None,
    duration_s=10.0,
    least_gap_m=4.0,
    least_distance_m=3.0,
    least_ttc_s=2.0,
    braking_s=1.0,
    phantom_brakings=0,
    off_road_share=0.0,
    lateral_peak_m=0.1,
    jerk_peak_mps3=5.0,
    jerk_rms_mps3=1.0,
    progress=1.0,
    score=1.0,
)


def result(twin: str, seed: int, *, is_crash: bool = False, scenario: str = "stopped_lead") -> DriveResult:
    run = DriveRun(driver="depth", town="t", scene="s", scenario=scenario, speed_kmh=40.0, seed=seed, twin=twin)
    measures = MEASURES
    if is_crash:
        measures = replace(MEASURES, is_crash=True, crash_kind="vehicle", impact_mps=5.0, braking_s=2.0, score=0.5)
    open_loop = {"rmse_m": 2.0 if is_crash else 1.0}
    return DriveResult(
        run=run, measures=measures, log_sha256="0" * 64, patch=twin, open_loop=open_loop, open_loop_metric="rmse_m"
    )


def study() -> DriveReport:
    """Ten seeds: no crash without a patch, one with a random patch, seven with the patch; one free road."""
    results = [result("none", seed) for seed in range(10)]
    results += [result("random", seed, is_crash=seed == 0) for seed in range(10)]
    results += [result("patch", seed, is_crash=seed < 7) for seed in range(10)]
    results += [result("none", 0, scenario="free_road")]
    return DriveReport(
        out=Path("out"),
        results=tuple(results),
        failed=(("a <drive>", "no place"),),
        facts={},
        free=frozenset({"free_road"}),
        errors=frozenset({"depth"}),
    )


def test_intervals_are_exact() -> None:
    """Clopper and Pearson: 0 of 10 has the upper end 1 - 0.025^(1/10), 7 of 10 has [0.348, 0.933]."""
    assert Rate.of([False] * 10).interval == pytest.approx((0.0, 1 - 0.025**0.1))
    assert Rate.of([True] * 7 + [False] * 3).interval == pytest.approx((0.348, 0.933), abs=1e-3)
    assert rate(Rate.of([])) == "" and rate(Rate.of([True, False])).startswith("50 % [1, 99]")


def test_mcnemar_counts_the_situations_in_which_only_one_crashed() -> None:
    rows = {(row.scenario, row.twin): row for row in study().rows()}
    none, random = rows["all", "patch"].paired
    assert (none.other, none.pairs, none.only_here, none.only_there) == ("none", 10, 7, 0)
    assert none.p == pytest.approx(2 / 2**7)
    assert none.braking_delay_s == pytest.approx(0.7) and none.score == pytest.approx(-0.35)
    assert (random.other, random.only_here, random.only_there) == ("random", 6, 0)
    assert rows["all", "none"].paired == ()
    assert rows["all", "none"].crashes.total == 10, "free roads do not count in the sum"


def test_twins_are_paired_by_situation() -> None:
    paired = compared([result("patch", 3, is_crash=True)], [result("none", 3), result("none", 4)], "none")
    assert paired.pairs == 1 and paired.only_here == 1
    assert compared([result("patch", 1)], [result("none", 2)], "none").p == 1.0


def test_the_tables() -> None:
    head, *rows = cells(study())
    assert all(len(row) == len(head) for row in rows)
    assert [row[1:3] for row in rows] == [
        ["stopped_lead", "none"], ["stopped_lead", "random"], ["stopped_lead", "patch"], ["free_road", "none"],
        ["all", "none"], ["all", "random"], ["all", "patch"],
    ]  # fmt: skip
    assert rows[2][head.index("open loop")] == "rmse_m 1.700", "seven of ten crashed, with twice the error"
    assert speed_cells(study())[3][4] == "70 % [35, 93]"
    shown = text(study())
    assert "not made: a <drive>: no place" in shown and "exact 95 % interval of Clopper and Pearson" in shown
    head, *rows = paired_cells(study())
    assert all(len(row) == len(head) for row in rows)
    assert rows[0][:8] == ["depth", "stopped_lead", "random", "none", "10", "1", "0", "1.000"]
    assert rows[2][2:9] == ["patch", "random", "10", "6", "0", "0.031", "+60 %"], "one scenario has no interval"
    titles = {title for row in (cells(study())[0], speed_cells(study())[0], head) for title in row}
    explained = " ".join([*DEFINITIONS, *DEFINITIONS.values()])
    assert not {title for title in titles if title not in explained} - {
        "driver", "scenario", "drives", "speed km/h", "against", "pairs",
    }  # fmt: skip


def test_differences_have_an_interval_over_scenarios() -> None:
    scenarios = ("stopped_lead", "slower_lead", "cut_in", "standing_pedestrian")
    here = [
        result("patch", seed, is_crash=place < 2, scenario=name)
        for place, name in enumerate(scenarios)
        for seed in (0, 1)
    ]
    there = [result("none", seed, scenario=name) for name in scenarios for seed in (0, 1)]
    paired = compared(here, there, "none")
    assert paired.crash_difference == 0.5 and paired.score == pytest.approx(-0.25)
    assert paired.crash_interval is not None and paired.score_interval is not None
    low, high = paired.crash_interval
    assert low == pytest.approx(0.5 - 4.303 * (1 / 12) ** 0.5, abs=1e-3), "Student's t of two degrees of freedom"
    assert high == 1.0, "a difference of shares is at most 1"
    assert mean_difference([None, None], [1, 2]) == (None, None)
    assert mean_difference([2.0, None, 2.0], [1, 2, 3]) == (2.0, None)


def test_the_page_escapes_names_and_has_no_scripts() -> None:
    shown = page(study(), [("a <title>", b"<svg/>")], [("a <video>", 'videos/"a".mp4')])
    assert '<a href="videos/%22a%22.mp4">a &lt;video&gt;</a>' in shown
    assert "a &lt;title&gt;" in shown and "data:image/svg+xml;base64,PHN2Zy8+" in shown
    assert "a &lt;drive&gt;" in shown and "<script" not in shown and "70 % [35, 93]" in shown
    assert "predicts crashes: 1.00 (20 drives with a patch, 8 crashed)" in shown and "the columns mean" in shown
    assert table([["a", "b"], ["x", "1"], ["x", "2"]], 2).count(">x<") == 1
