"""Rate and time left, as numbers and in the line of a log."""

from __future__ import annotations

import pytest

from gear.reporting.pace import Pace
from gear.reporting.progress_text import progress_line


def test_only_what_this_run_did_counts_for_the_rate() -> None:
    pace = Pace("sample", first_done=100, first_s=10.0, done=130, total=200)
    assert pace.rate(20.0) == 3.0
    assert pace.left_s(20.0) == pytest.approx(70 / 3)
    assert progress_line(pace, 20.0) == "130 of 200 samples, 3 per second, 23 seconds left"


def test_the_first_items_with_their_preparation_do_not_count() -> None:
    pace = Pace("sample", first_done=0, first_s=0.0, done=0, total=10)
    pace.report(1, 10, 100.0)
    assert pace.rate(100.0) == 0.01, "there is no other yet"
    pace.report(3, 10, 104.0)
    assert pace.rate(104.0) == 0.5 and pace.left_s(104.0) == 14.0


def test_a_smaller_number_begins_another_count() -> None:
    pace = Pace("sample", first_done=0, first_s=0.0, done=0, total=1000)
    pace.report(500, 1000, 10.0)
    pace.report(1000, 1000, 20.0)
    pace.report(0, 40, 20.0)
    assert (pace.rate(30.0), pace.left_s(30.0)) == (0.0, None)
    pace.report(10, 40, 40.0)
    assert (pace.rate(40.0), pace.left_s(40.0)) == (0.5, 60.0)


def test_nothing_is_promised_before_there_is_a_rate() -> None:
    pace = Pace("query", first_done=4, first_s=1.0, done=4, total=9)
    assert (pace.rate(1.0), pace.rate(50.0), pace.left_s(50.0)) == (0.0, 0.0, None)
    assert progress_line(pace, 50.0) == "4 of 9 queries, 49 seconds so far"
    assert progress_line(Pace("file", 0, 0.0, 6, 0), 2.0) == "6 files, 3 per second", "an unknown total"
