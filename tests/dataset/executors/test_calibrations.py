"""Progress of calibrations: what a worker reports, and what the command shows of several workers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from gear.contracts.executors import Executor, Outcome, Report
from gear.dataset.executors import calibrations
from gear.dataset.executors.calibrations import CalibrationProgress, CalibrationReports, ShownCalibrations
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.executors.jobs import carry_out_jobs, run_jobs
from gear.dataset.executors.parts import run_part
from gear.dataset.executors.processes import Processes
from gear.values.progress import Callbacks


def calibrate(indices: Iterator[int], report: Report) -> None:
    reports = CalibrationReports(report=report)
    callbacks = reports.callbacks()

    def call(index: int) -> int:
        reports.index = index
        callbacks.on_fit_progress(1, 1)
        for done in range(3):
            callbacks.on_fit_phase("training step", done, 2)
        callbacks.on_progress(7, 7)
        return index

    carry_out_jobs(call, indices, report)


@pytest.mark.parametrize("executor", [InThisProcess(), Processes(workers=1, backend="test")])
def test_calibrations_in_workers_reach_the_callbacks_of_the_command(executor: Executor) -> None:
    seen: list[tuple[str, int, int]] = []
    outcomes: list[Outcome] = []
    callbacks = Callbacks.of(
        on_progress=lambda done, total: seen.append(("progress", done, total)),
        on_fit_progress=lambda done, total: seen.append(("", done, total)),
        on_fit_phase=lambda *phase: seen.append(phase),
    )
    assert run_jobs(executor, calibrate, [4, 5], outcomes.append, callbacks=callbacks) == {}
    assert [(outcome.index, outcome.kind, outcome.value) for outcome in outcomes] == [(4, "made", 4), (5, "made", 5)]
    once = [("", 1, 1), ("training step", 0, 2), ("training step", 2, 2)]
    assert seen[:3] == once and {*seen[3:]} <= {*once, ("training step", 1, 2)} and seen[-1] == once[-1]


def test_few_messages_are_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [0.0]
    monkeypatch.setattr(calibrations.time, "monotonic", lambda: now_s[0])
    sent: list[Outcome] = []
    callbacks = CalibrationReports(report=sent.append, index=3).callbacks()
    for done in range(1, 101):
        now_s[0] += 0.25
        callbacks.on_fit_progress(done, 100)
    assert 20 <= len(sent) <= 27 and sent[0].index == 3
    assert sent[-1].value == CalibrationProgress(unit="", done=100, total=100)


def test_one_calibration_is_shown_at_a_time() -> None:
    seen: list[int] = []
    shown = ShownCalibrations(callbacks=Callbacks.of(on_fit_progress=lambda done, total: seen.append(done)))

    def report(index: int, done: int) -> None:
        assert shown.takes(
            Outcome(index=index, kind="underway", value=CalibrationProgress(unit="", done=done, total=9))
        )

    report(0, 1)
    report(1, 5)
    report(0, 2)
    assert not shown.takes(Outcome(index=1, kind="failed")) and seen == [1, 2]
    assert not shown.takes(Outcome(index=0))
    report(1, 6)
    assert seen == [1, 2, 6]


def test_parts_that_end_elsewhere_send_their_outcomes_alone() -> None:
    result = run_part(calibrate, [0, 1])
    assert isinstance(result, list) and [outcome.kind for outcome in result] == ["made", "made"]
