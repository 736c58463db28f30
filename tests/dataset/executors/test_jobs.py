"""Jobs of any kind on an engine: results, failures, lost workers, and the folder of the command."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import pytest

from gear.contracts.executors import MOST_FAILURES, Outcome, Report, Work
from gear.dataset.executors.in_process import InThisProcess
from gear.dataset.executors.jobs import (
    FAILURES,
    FURTHER_TRIES,
    JobNotes,
    carry_out_jobs,
    run_jobs,
    shared_folder,
    try_jobs,
)
from gear.dataset.executors.processes import Processes
from gear.values.errors import BackendError, GearError, WorkerInterruptedError


def square(index: int) -> int:
    if index < 0:
        raise GearError(f"job {index} has no square")
    return index**2


def squares(indices: Iterator[int], report: Report) -> None:
    carry_out_jobs(square, indices, report)


class Losing:
    """An executor that loses the worker of one job some times."""

    def __init__(self, lost: int, times: int) -> None:
        self.lost, self.times = lost, times

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        for index in indices:
            if index == self.lost and self.times:
                self.times -= 1
                report(Outcome(index=index, kind="failed", error="a worker was lost"))
            else:
                work(iter([index]), report)


def test_results_come_back_from_worker_processes() -> None:
    found: dict[int, object] = {}
    failed = run_jobs(
        Processes(workers=2, backend="test"),
        squares,
        [3, -1, 4],
        lambda outcome: found.update({outcome.index: outcome.value}),
    )
    assert found == {3: 9, -1: None, 4: 16}
    assert {index: outcome.error for index, outcome in failed.items()} == {-1: "job -1 has no square"}


@pytest.mark.parametrize("times", [FURTHER_TRIES, FURTHER_TRIES + 1])
def test_a_job_whose_worker_is_lost_is_tried_again_twice(times: int) -> None:
    reported: list[Outcome] = []
    failed = run_jobs(Losing(4, times), squares, [3, 4], reported.append)
    assert sum(outcome.index == 4 for outcome in reported) == FURTHER_TRIES + 1
    assert list(failed) == ([] if times == FURTHER_TRIES else [4])


def test_a_job_that_fails_for_good_is_tried_once_and_too_many_end_the_worker() -> None:
    reported: list[Outcome] = []
    failed = run_jobs(InThisProcess(), squares, list(range(-9, 0)), reported.append)
    assert len(reported) == 9 and sorted(failed) == list(range(-9, 0))
    assert sum("has no square" in outcome.error for outcome in reported) == MOST_FAILURES
    assert failed[-1].error == "not carried out, because other jobs failed"


class Odd:
    """Jobs of which some end with an error that nobody expects, a few times."""

    def __init__(self, error: Exception, times: int) -> None:
        self.error, self.times, self.called = error, times, list[int]()

    def work(self, indices: Iterator[int], report: Report) -> None:
        carry_out_jobs(self.call, indices, report)

    def call(self, index: int) -> int:
        self.called.append(index)
        if index == 1 and self.times:
            self.times -= 1
            raise self.error
        return index


def test_a_job_that_ends_with_an_unexpected_error_is_tried_again_and_then_noted(tmp_path: Path) -> None:
    notes = JobNotes(root=tmp_path, names=["a", "b", "c"])
    for times in (FURTHER_TRIES, FURTHER_TRIES + 1):
        odd = Odd(ValueError("boom\x1b[2J\nmore"), times)
        failed = run_jobs(InThisProcess(), odd.work, range(3), lambda outcome: None, notes=notes)
        assert odd.called == [0, 1, 2, *[1] * FURTHER_TRIES]
        assert list(failed) == ([] if times == FURTHER_TRIES else [1])
    assert failed[1].error == "ValueError: boom?[2J"
    assert notes.summary(failed, "jobs") == f"b: ValueError: boom?[2J; the errors are noted in {tmp_path / FAILURES}"
    note = json.loads((tmp_path / FAILURES / "1.json").read_text())
    assert note["job"] == "b" and note["tries"] == FURTHER_TRIES + 1
    assert any("in call" in line for line in note["traceback"])
    assert run_jobs(InThisProcess(), Odd(ValueError(), 0).work, range(3), lambda outcome: None, notes=notes) == {}
    assert not (tmp_path / FAILURES).exists()


@pytest.mark.parametrize(("error", "tries"), [(BackendError("raster", "hangs", "wait"), 3), (GearError("no"), 1)])
def test_a_renderer_that_does_not_start_is_tried_again(error: GearError, tries: int) -> None:
    wrapped = GearError("step: failed")
    wrapped.__cause__ = error
    odd = Odd(wrapped, 9)
    run_jobs(InThisProcess(), odd.work, range(2), lambda outcome: None)
    assert odd.called.count(1) == tries


@pytest.mark.parametrize(
    "error", [OSError(errno.EMFILE, "Too many open files"), MemoryError(), WorkerInterruptedError("a", "b", "c")]
)
def test_limits_of_the_machine_and_interrupts_end_the_run(error: Exception) -> None:
    odd = Odd(error, 1)
    with pytest.raises(type(error)):
        run_jobs(InThisProcess(), odd.work, range(3), lambda outcome: None)
    assert odd.called == [0, 1]


def test_nothing_is_said_about_jobs_that_no_worker_took() -> None:
    reported: list[Outcome] = []
    failed = try_jobs(InThisProcess(), squares, list(range(-9, 0)), reported.append)
    assert len(reported) == len(failed) == MOST_FAILURES


def note_folder(folder: str, indices: Iterator[int], report: Report) -> None:
    with shared_folder(folder):
        carry_out_jobs(lambda index: str(Path.cwd()), indices, report)


def test_workers_are_in_the_folder_of_the_command(tmp_path: Path) -> None:
    here, found = Path.cwd(), list[object]()
    run_jobs(InThisProcess(), partial(note_folder, str(tmp_path)), [0], lambda outcome: found.append(outcome.value))
    assert found == [str(tmp_path)] and Path.cwd() == here
    with pytest.raises(GearError, match="is not there on this machine"), shared_folder(str(tmp_path / "gone")):
        pass
