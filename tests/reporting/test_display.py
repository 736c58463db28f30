"""Displays: plain lines without a terminal, also while nothing is reported; warnings once; bars for scripts."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest

from gear.reporting import display
from gear.reporting.display import Display, displayed
from gear.values.progress import Callbacks

EVERY_S = display.EVERY_S


def test_a_log_has_a_line_at_least_once_a_minute() -> None:
    assert EVERY_S <= 30, "half a minute, because the thread may be late"


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


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time of displays in seconds; tests move it, and no line is written on its own."""
    now = [0.0]
    monkeypatch.setattr(display, "EVERY_S", 1000.0)
    monkeypatch.setattr(display, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


def test_lines_of_every_part_of_a_job_have_rate_and_time_left(clock: list[float]) -> None:
    lines = display._Lines("collect")
    seen = []

    def at(seconds: float, channel: str, done: int, total: int) -> None:
        clock[0] = seconds
        lines.update(channel, "sample" if channel == "progress" else "", done, total)
        seen.append(lines._line())

    at(0, "part checking existing samples", 0, 0)
    clock[0] = 45
    seen.append(lines._line())
    at(60, "part checking existing samples", 100, 400)
    at(80, "part checking existing samples", 200, 400)
    at(120, "progress", 400, 1000)
    at(180, "progress", 401, 1000)
    at(200, "progress", 421, 1000)
    at(300, "progress", 0, 50)
    at(310, "progress", 1, 50)
    at(330, "progress", 11, 50)
    lines.close()
    assert seen == [
        "gear collect: checking existing samples since 1 second",
        "gear collect: checking existing samples since 45 seconds",
        "gear collect: checking existing samples, 100 of 400, 1.67 per second, 3 minutes left",
        "gear collect: checking existing samples, 200 of 400, 5 per second, 40 seconds left",
        "gear collect: 400 of 1000 samples, 1 second so far",
        "gear collect: 401 of 1000 samples, 1 per minute, 10.0 hours left",
        "gear collect: 421 of 1000 samples, 1 per second, 10 minutes left",
        "gear collect: 0 of 50 samples, 1 second so far",
        "gear collect: 1 of 50 samples, 6 per minute, 8 minutes left",
        "gear collect: 11 of 50 samples, 30 per minute, 78 seconds left",
    ]


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


def test_a_terminal_names_the_parts_of_a_job(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with Display("verify") as shown:
        count = shown.callbacks.part("checking existing samples")
        assert "checking existing samples …" in capsys.readouterr().err
        count(3, 8)
        count(5, 8)
        shown.callbacks.on_progress(7, 9)
        shown.callbacks.on_progress(0, 4)
        shown.callbacks.on_progress(2, 4)
    seen = capsys.readouterr().err
    assert "checking existing samples:" in seen and "/8" in seen and "7/9" in seen and "2/4" in seen


def test_a_script_hears_and_sees(capsys: pytest.CaptureFixture[str]) -> None:
    heard: list[tuple[int, int]] = []
    callbacks = Callbacks.of(on_progress=lambda *done: heard.append(done))
    with displayed(callbacks, "gap", progress=True) as both:
        both.on_progress(1, 3)
        assert "gear gap: 1 of 3 samples" in wait_for(capsys, "1 of 3")
    with displayed(callbacks, "gap", progress=False) as alone:
        assert alone is callbacks
    assert heard == [(1, 3)]


def test_a_note_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    with Display("collect") as shown:
        shown.callbacks.on_warning(f"sample 3 failed (got '{'x' * 5000}'\nsecond line \x1b[31m)")
    (said,) = (line for line in capsys.readouterr().err.splitlines() if not line.startswith("gear collect: "))
    assert said.endswith("second line \\x1b[31m)") and len(said) < 300
