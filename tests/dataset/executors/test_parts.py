"""Parts of a job's items, for engines of several machines."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from gear.contracts.executors import Outcome
from gear.dataset.executors.parts import LARGEST, PARTS_PER_WORKER, report_lost, report_part, run_part, split_in_parts
from gear.values.errors import GearError


@pytest.mark.parametrize(("count", "workers"), [(0, 2), (1, 4), (100, 3), (10_000, 2)])
def test_parts_are_neighbours_of_limited_size_and_cover_all_items(count: int, workers: int) -> None:
    parts = split_in_parts(range(count), workers)
    assert [index for part in parts for index in part] == list(range(count))
    assert all(0 < len(part) <= LARGEST for part in parts)
    assert len(parts) >= min(count, workers * PARTS_PER_WORKER)


def test_outcomes_come_back_and_an_error_as_its_text() -> None:
    def work(indices: Iterable[int], report: Callable[[Outcome], None]) -> None:
        for index in indices:
            if index == 9:
                raise GearError("no renderer")
            report(Outcome(index=index))

    assert run_part(work, [1, 2]) == [Outcome(index=1), Outcome(index=2)]
    assert run_part(work, [1, 9]) == "no renderer"


def test_reports_say_whether_anything_was_made() -> None:
    found: list[Outcome] = []
    failed = Outcome(index=1, kind="failed", error="broken")
    assert not report_part([failed], found.append)
    assert report_part([failed, Outcome(index=2, kind="elsewhere")], found.append)
    assert [outcome.index for outcome in found] == [1, 1, 2]
    with pytest.raises(GearError, match="no renderer"):
        report_part("no renderer", found.append)


def test_lost_items_are_reported_as_failed() -> None:
    found: list[Outcome] = []
    report_lost([4, 5], "worker lost", found.append)
    assert found == [Outcome(index=index, kind="failed", error="worker lost") for index in (4, 5)]
