"""The contract of execution engines (how work is distributed to workers), as tests.

Subclass `ExecutorContract` in a test of an engine, and define the fixture `executor`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from gear.contracts.executors import MOST_FAILURES, Executor, Outcome, Report
from gear.values.errors import GearError


def write_items(folder: str, failing: tuple[int, ...], indices: Iterator[int], report: Report) -> None:
    """Work for tests: writes one file per item and reports the item; items in `failing` are reported as failed.

    The files let a test count how often each item was made.

    Args:
        folder: folder of the written files.
        failing: items that are reported as failed.
        indices: the items of this worker.
        report: called with the outcome of each item.
    """
    in_row = 0
    for index in indices:
        if index in failing:
            in_row += 1
            report(Outcome(index=index, kind="failed", error=f"item {index} cannot be made"))
            if in_row >= MOST_FAILURES:
                return
            continue
        in_row = 0
        with (Path(folder) / str(index)).open("a") as file:
            file.write("made ")
        report(Outcome(index=index))


def cannot_start(indices: Iterator[int], report: Report) -> None:
    """Work for tests that fails before its first item.

    Args:
        indices: the items of this worker; not used.
        report: not used.

    Raises:
        GearError: always.
    """
    raise GearError("no renderer here")


class ExecutorContract:
    """The promises of an execution engine, as tests; subclasses define the fixture `executor`."""

    @pytest.fixture
    def executor(self) -> Executor:
        """The engine that is tested; a pytest fixture that subclasses define."""
        raise NotImplementedError

    def test_every_item_is_made_once_and_reported_once(self, executor: Executor, tmp_path: Path) -> None:
        """Every item is made once and reported once, in any order."""
        reported: list[Outcome] = []
        executor.run(partial(write_items, str(tmp_path), ()), [5, 3, 9, 0, 7], reported.append)
        assert sorted(outcome.index for outcome in reported) == [0, 3, 5, 7, 9]
        assert {outcome.kind for outcome in reported} == {"made"}
        assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys("03579", "made ")

    def test_a_failed_item_keeps_no_other_from_being_made(self, executor: Executor, tmp_path: Path) -> None:
        """A failure is reported with its error, and all other items are made."""
        reported: dict[int, Outcome] = {}
        work = partial(write_items, str(tmp_path), (2,))
        executor.run(work, [1, 2, 3], lambda outcome: reported.update({outcome.index: outcome}))
        assert {index: outcome.kind for index, outcome in reported.items()} == {1: "made", 2: "failed", 3: "made"}
        assert reported[2].error == "item 2 cannot be made"

    def test_an_error_that_is_not_of_one_item_ends_the_run(self, executor: Executor) -> None:
        """An error of the work itself, not of a single item, is raised by `run`."""
        with pytest.raises(GearError, match="no renderer here"):
            executor.run(cannot_start, [0, 1], lambda outcome: None)

    def test_nothing_is_started_without_an_item(self, executor: Executor) -> None:
        """Without items no worker is started and nothing is reported."""
        executor.run(cannot_start, [], lambda outcome: pytest.fail("there is no item"))
