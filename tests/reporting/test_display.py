"""Displays: plain lines without a terminal, also while nothing is reported; warnings once; bars for scripts."""

from __future__ import annotations

import time

import pytest

from gear.reporting import display
from gear.reporting.display import Display, displayed
from gear.values.progress import Callbacks


@pytest.fixture(autouse=True)
def often(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "EVERY_S", 0.02)


def wait_for(capsys: pytest.CaptureFixture[str], text: str) -> str:
    """What was written until the text is there."""
    seen, end_s = "", time.monotonic() + 20
    while text not in seen and time.monotonic() < end_s:
        time.sleep(0.01)
        seen += capsys.readouterr().err
    return seen


def test_a_log_has_lines_also_before_the_first_report(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("attack", unit="step") as shown:
        assert "gear attack: preparing since 1 second\n" in wait_for(capsys, "preparing")
        shown.callbacks.on_fit_progress(3, 8)
        assert "gear attack: calibrating the defense, 3 of 8 pictures" in wait_for(capsys, "3 of 8")
        shown.callbacks.on_progress(0, 300)
        shown.callbacks.on_progress(12, 300)
        shown.detail("loss 0.5")
        assert " per second" in wait_for(capsys, "loss 0.5")
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("gear attack: 12 of 300 steps, ") and last.endswith("left, loss 0.5")


def test_phases_of_a_calibration_are_shown_instead_of_its_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("evaluate") as shown:
        shown.callbacks.on_fit_phase("clean picture", 80, 80)
        shown.callbacks.on_fit_progress(80, 80)
        shown.callbacks.on_fit_phase("training step", 0, 1750)
        shown.callbacks.on_fit_phase("training step", 700, 1750)
        shown.callbacks.on_fit_progress(80, 80)
        line = wait_for(capsys, "training steps").splitlines()[-1]
    assert line.startswith("gear evaluate: calibrating the defense, 700 of 1750 training steps, ")
    assert " per second, " in line and line.endswith(" left")


def test_a_step_of_several_has_its_title(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("bench") as shown:
        shown.callbacks.on_progress(5, 6)
        shown.begin("[2/9] attack small", unit="step")
        assert "5 of 6" not in wait_for(capsys, "gear bench: [2/9] attack small: preparing").rpartition("[2/9]")[2]
        shown.callbacks.on_progress(1, 4)
        assert "gear bench: [2/9] attack small: 1 of 4 steps" in wait_for(capsys, "1 of 4")


def test_what_ends_soon_writes_nothing(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(display, "EVERY_S", 60.0)
    with Display("collect") as shown:
        shown.callbacks.on_progress(2, 2)
    assert capsys.readouterr().err == ""


def test_a_warning_is_said_once(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("evaluate") as shown:
        for _ in range(3):
            shown.callbacks.on_warning("the patch was made for another scene")
    assert capsys.readouterr().err.count("gear: note: the patch was made for another scene\n") == 1


def test_a_terminal_has_bars(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with Display("train", unit="step") as shown:
        shown.callbacks.on_progress(1, 10)
        shown.callbacks.on_progress(4, 12)
        shown.detail("loss 0.25")
        shown.write("step 4  miou 0.5")
    seen = capsys.readouterr().err
    assert "4/12" in seen and "step/s" in seen and "loss 0.25" in seen and "step 4  miou 0.5\n" in seen


def test_a_script_hears_and_sees(capsys: pytest.CaptureFixture[str]) -> None:
    heard: list[tuple[int, int]] = []
    callbacks = Callbacks.of(on_progress=lambda *done: heard.append(done))
    with displayed(callbacks, "gap", progress=True) as both:
        both.on_progress(1, 3)
        assert "gear gap: 1 of 3 samples" in wait_for(capsys, "1 of 3")
    with displayed(callbacks, "gap", progress=False) as alone:
        assert alone is callbacks
    assert heard == [(1, 3)]
