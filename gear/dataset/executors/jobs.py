"""Runs jobs, such as attacks, evaluations and steps of a benchmark, on an engine (local processes, Ray or Slurm).

A job that ends with an error that the user can correct has failed for good. A job that ends with any other error, or
whose worker was lost, is tried again twice; if it still fails, its error and traceback are written to a file.
"""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from gear.contracts.executors import MOST_FAILURES, Executor, Outcome, Report, Work
from gear.dataset.executors.calibrations import ShownCalibrations
from gear.dataset.files import write_whole
from gear.dataset.guarded_paths import remove_empty_folders, remove_files
from gear.dataset.json_text import dump_json
from gear.values.errors import BackendError, GearError, WorkerInterruptedError
from gear.values.progress import NO_CALLBACKS, Callbacks

FURTHER_TRIES = 2
"""Number of further attempts to carry out a job that failed with an unexpected error, or whose worker was lost."""

LONGEST = 200
"""Largest number of characters of an unexpected error in a message."""

FAILURES = "failures"
"""Folder of the notes on jobs that failed, in the folder of a command's results."""

NOT_OF_A_JOB = (OSError, MemoryError, WorkerInterruptedError)
"""Errors of the disk, of the machine's limits, and interrupts, which end a run because they do not concern a single
job.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class JobNotes:
    """The notes on jobs that failed: one JSON file for each, in the folder `failures` of a command's results.

    Attributes:
        root: folder of the command's results.
        names: names of all jobs, by their indices.
    """

    root: Path
    names: Sequence[str]

    def write(self, failed: dict[int, Outcome], tries: dict[int, int]) -> None:
        """Writes a note for each job that failed, and deletes the notes of jobs that succeeded.

        Args:
            failed: the last outcome of each job that failed.
            tries: number of attempts at each job that has ended, by index.

        Raises:
            DatasetError: a note cannot be written or deleted.
        """
        remove_files(self.root, [self._path(index) for index in tries if index not in failed])
        remove_empty_folders(self.root, FAILURES)
        for index, outcome in failed.items():
            trace = outcome.trace.encode(errors="backslashreplace").decode().splitlines()
            note = {"job": self.names[index], "tries": tries[index], "error": outcome.error, "traceback": trace}
            write_whole(self.root, self._path(index), dump_json(note))

    def summary(self, failed: dict[int, Outcome], what: str) -> str:
        """Returns one line on the first job that failed, the number of the others, and the folder of the notes.

        Args:
            failed: the last outcome of each job that failed; not empty.
            what: what the jobs are, in the plural, such as `scenes`.
        """
        first = min(failed)
        more = f"; {len(failed) - 1} more of {len(self.names)} {what} failed" if len(failed) > 1 else ""
        return f"{self.names[first]}: {failed[first].error}{more}; the errors are noted in {self.root / FAILURES}"

    @staticmethod
    def _path(index: int) -> str:
        return f"{FAILURES}/{index}.json"


def carry_out_jobs(call: Callable[[int], object], indices: Iterable[int], report: Report) -> None:
    """Carries out jobs one after the other; runs in a worker.

    After `MOST_FAILURES` failures in a row no further job is carried out.

    Args:
        call: carries out one job, and returns its result, which can be pickled. An exception is a failure of the job.
        indices: indices of the jobs.
        report: called with the outcome of each job.

    Raises:
        OSError, MemoryError, WorkerInterruptedError: the disk, a limit of the machine or an interrupt ends the run.
    """
    in_row = 0
    for index in indices:
        try:
            value = call(index)
        except Exception as error:
            if any(isinstance(one, NOT_OF_A_JOB) for one in _and_wrapped(error)):
                raise
            in_row += 1
            report(_failure(index, error))
            if in_row >= MOST_FAILURES:
                return
        else:
            in_row = 0
            report(Outcome(index=index, value=value))


def _and_wrapped(error: BaseException) -> Iterator[BaseException]:
    """Yields an error, and each `GearError` that it wraps, for example to add the title of a step."""
    yield error
    if isinstance(error, GearError) and isinstance(error.__cause__, GearError):
        yield from _and_wrapped(error.__cause__)


def _failure(index: int, error: Exception) -> Outcome:
    """Returns the outcome of a job that raised an error. A renderer that does not start may start at another try."""
    trace = "".join(traceback.format_exception(error))
    if isinstance(error, GearError):
        is_final = not any(isinstance(one, BackendError) for one in _and_wrapped(error))
        return Outcome(index=index, kind="failed", error=str(error), trace=trace, is_final=is_final)
    first = "".join(traceback.format_exception_only(error)).splitlines()[0]
    line = "".join(char if char.isprintable() else "?" for char in first[:LONGEST])
    return Outcome(index=index, kind="failed", error=line, trace=trace)


@dataclass(slots=True, kw_only=True, eq=False)
class _Ran:
    """What is known about the jobs of a run.

    Attributes:
        report: function of the command that is called with each outcome.
        calibrations: shows calibrations of the workers.
        failed: the last outcome of each job that failed.
        tries: number of outcomes of each job.
    """

    report: Report
    calibrations: ShownCalibrations
    failed: dict[int, Outcome] = field(default_factory=dict)
    tries: dict[int, int] = field(default_factory=dict)

    def note(self, outcome: Outcome) -> None:
        """Notes an outcome and passes it on."""
        if self.calibrations.takes(outcome):
            return
        self.tries[outcome.index] = self.tries.get(outcome.index, 0) + 1
        self.failed.pop(outcome.index, None)
        if outcome.kind == "failed":
            self.failed[outcome.index] = outcome
        self.report(outcome)


def run_jobs(
    executor: Executor,
    work: Work,
    indices: Sequence[int],
    report: Report,
    *,
    callbacks: Callbacks = NO_CALLBACKS,
    notes: JobNotes | None = None,
) -> dict[int, Outcome]:
    """Carries out jobs with an executor; jobs that failed with an unexpected error, or whose worker was lost, are tried
    again twice, unless the workers have given up after several failures in a row.

    Args:
        executor: executor that carries out the jobs.
        work: function that carries out jobs in a worker.
        indices: indices of the jobs.
        report: called in this process with each outcome; a job that is tried again has several.
        callbacks: callbacks that receive the progress of calibrations in the workers.
        notes: where the errors of failed jobs are noted; None notes nothing.

    Returns:
        The last outcome of each job that failed, by index; jobs that no worker took are among them.

    Raises:
        GearError: a worker raised an error that does not concern a single job.
    """
    begun: set[int] = set()

    def report_and_count(outcome: Outcome) -> None:
        begun.add(outcome.index)
        report(outcome)

    failed = try_jobs(executor, work, indices, report_and_count, callbacks=callbacks, notes=notes)
    for index in indices:
        if index not in begun:
            error = "not carried out, because other jobs failed"
            failed[index] = Outcome(index=index, kind="failed", error=error, is_final=True)
            report(failed[index])
    return failed


def try_jobs(
    executor: Executor,
    work: Work,
    indices: Sequence[int],
    report: Report,
    *,
    callbacks: Callbacks = NO_CALLBACKS,
    notes: JobNotes | None = None,
) -> dict[int, Outcome]:
    """Carries out jobs as `run_jobs` does, but says nothing about jobs that no worker took.

    Args:
        executor, work, indices, report, callbacks, notes: as in `run_jobs`.

    Returns:
        The last outcome of each job that failed, by index.

    Raises:
        GearError: a worker raised an error that does not concern a single job.
    """
    ran = _Ran(report=report, calibrations=ShownCalibrations(callbacks=callbacks))
    left = list(indices)
    try:
        for _ in range(1 + FURTHER_TRIES):
            executor.run(work, left, ran.note)
            if len(ran.tries) < len(indices):  # the workers have given up: the cause is no single job
                break
            left = [index for index in left if index in ran.failed and not ran.failed[index].is_final]
    finally:
        if notes is not None:
            notes.write(ran.failed, ran.tries)
    return ran.failed


@contextlib.contextmanager
def shared_folder(folder: str | None) -> Iterator[None]:
    """A context in which the current folder of a worker is that of the command, so that relative paths mean the same.

    Args:
        folder: the current folder of the command; None changes nothing.

    Raises:
        GearError: the folder is not there on the worker's machine.
    """
    if folder is None:
        yield
        return
    if not Path(folder).is_dir():
        raise GearError(f"{folder} is not there on this machine; run the command in a folder that all machines share")
    with contextlib.chdir(folder):
        yield
