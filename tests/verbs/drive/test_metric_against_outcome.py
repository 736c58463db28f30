"""The metric lost by a patch, beside the outcome of the drive."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gear.driving.drives import DriveRun
from gear.driving.measures import Measures
from gear.driving.worker import DriveResult
from gear.verbs.drive.metric_against_outcome import MetricLoss, auroc, metric_losses, scatter

MEASURES = Measures(
    ending="time", is_crash=False, crash_kind="", impact_mps=None, duration_s=1.0, least_gap_m=None,
    least_distance_m=None, least_ttc_s=2.0, braking_s=None, phantom_brakings=0, off_road_share=0.0,
    lateral_peak_m=0.0, jerk_peak_mps3=0.0, jerk_rms_mps3=0.0, progress=1.0, score=1.0,
)  # fmt: skip


def done(twin: str, seed: int, value: float | None, *, is_crash: bool = False) -> DriveResult:
    run = DriveRun(driver="$d_1", town="t", scene="s", scenario="c", speed_kmh=30.0, seed=seed, twin=twin)
    open_loop = {} if value is None else {"metric": value}
    measures = replace(MEASURES, is_crash=is_crash)
    return DriveResult(
        run=run, measures=measures, log_sha256="", patch=twin, open_loop=open_loop, open_loop_metric="metric"
    )


RESULTS = [
    done("none", 0, 0.9), done("none", 1, 0.8), done("none", 2, None),
    done("patch", 0, 0.5, is_crash=True), done("patch", 1, 0.7), done("patch", 2, 0.1), done("patch", 3, 0.1),
    done("random", 0, None),
]  # fmt: skip


def test_losses_are_against_the_clean_twin_of_the_same_situation() -> None:
    found = metric_losses(RESULTS, set())
    assert [(one.seed, one.is_crash) for one in found] == [(0, True), (1, False)]
    assert [one.lost for one in found] == pytest.approx([0.4, 0.1])
    assert [one.lost for one in metric_losses(RESULTS, {"$d_1"})] == pytest.approx([-0.4, -0.1])


def lost(value: float, *, is_crash: bool) -> MetricLoss:
    (one,) = metric_losses([done("none", 0, 1.0), done("patch", 0, 1.0 - value, is_crash=is_crash)], set())
    return one


def test_the_area_under_the_curve() -> None:
    assert auroc([lost(0.5, is_crash=True), lost(0.1, is_crash=False)]) == 1.0
    assert auroc([lost(0.1, is_crash=True), lost(0.5, is_crash=False)]) == 0.0
    assert auroc([lost(0.5, is_crash=True), lost(0.5, is_crash=False), lost(0.75, is_crash=False)]) == 0.25
    assert auroc([lost(0.5, is_crash=True)]) is None


def test_equal_losses_give_equal_charts() -> None:
    found = metric_losses(RESULTS, set())
    assert scatter(found) == scatter(found) and scatter(found).startswith(b"<?xml")
    assert scatter(found) != scatter(found[:1])
    assert scatter([replace(found[0], least_ttc_s=None)])
