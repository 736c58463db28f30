"""The report of a page."""

from __future__ import annotations

from pathlib import Path

from gear.view.write import ViewReport


def test_the_summary_is_safe_to_print() -> None:
    report = ViewReport(path=Path("a.html"), samples=1, size_bytes=1, scale=1.0, problems=((0, "bad\x1b[2J\nline"),))
    assert report.summary().count("\n") == 1 and "\x1b" not in report.summary()
