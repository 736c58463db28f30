"""Rate and time left, in words."""

from __future__ import annotations

import pytest

from gear.reporting.pace import Pace, duration_text, plural, rate_text


def test_only_what_this_run_did_counts_for_the_rate() -> None:
    pace = Pace("sample", first_done=100, first_s=10.0, done=130, total=200)
    assert pace.rate(20.0) == 3.0
    assert pace.left_s(20.0) == pytest.approx(70 / 3)
    assert pace.line(20.0) == "130 of 200 samples, 3 per second, 23 seconds left"


def test_the_first_items_with_their_preparation_do_not_count() -> None:
    pace = Pace("sample", first_done=0, first_s=0.0, done=0, total=10)
    pace.report(1, 10, 100.0)
    assert pace.rate(100.0) == 0.01, "there is no other yet"
    pace.report(3, 10, 104.0)
    assert pace.rate(104.0) == 0.5 and pace.left_s(104.0) == 14.0


def test_nothing_is_promised_before_there_is_a_rate() -> None:
    pace = Pace("query", first_done=4, first_s=1.0, done=4, total=9)
    assert (pace.rate(1.0), pace.rate(50.0), pace.left_s(50.0)) == (0.0, 0.0, None)
    assert pace.line(50.0) == "4 of 9 queries, 49 seconds so far"
    assert Pace("file", 0, 0.0, 6, 0).line(2.0) == "6 files, 3 per second", "an unknown total"


def test_words() -> None:
    assert [rate_text(rate) for rate in (12.34, 1.0, 0.05, 0.001, 1e-9)] == [
        "12.3 per second", "1 per second", "3 per minute", "3.6 per hour", "3.6e-06 per hour",
    ]  # fmt: skip
    assert [duration_text(seconds) for seconds in (0.2, 1.4, 99.4, 99.6, 5940, 5980, 172_900)] == [
        "1 second", "1 second", "99 seconds", "2 minutes", "99 minutes", "1.7 hours", "2.0 days",
    ]  # fmt: skip
    assert [plural("sample", 1), plural("sample", 0), plural("query", 2)] == ["sample", "samples", "queries"]
