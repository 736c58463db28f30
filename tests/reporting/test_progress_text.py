"""Rates, durations and counted units as text."""

from __future__ import annotations

from gear.reporting.progress_text import duration_text, plural, rate_text


def test_rates_durations_and_units_as_text() -> None:
    assert [rate_text(rate) for rate in (12.34, 1.0, 0.05, 0.001, 1e-9)] == [
        "12.3 per second", "1 per second", "3 per minute", "3.6 per hour", "3.6e-06 per hour",
    ]  # fmt: skip
    assert [duration_text(seconds) for seconds in (0.2, 1.4, 99.4, 99.6, 5940, 5980, 172_900)] == [
        "1 second", "1 second", "99 seconds", "2 minutes", "99 minutes", "1.7 hours", "2.0 days",
    ]  # fmt: skip
    assert [plural("sample", 1), plural("sample", 0), plural("query", 2)] == ["sample", "samples", "queries"]
