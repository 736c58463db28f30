"""Jobs of any kind on an engine, such as attacks, evaluations and steps of a benchmark: what their callers share.

A job that ends with an error that the user can correct has failed for good. A job whose worker was lost is tried again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from gear.contracts.executors import MOST_FAILURES, Executor, Outcome, Report, Work
from gear.values.errors import GearError

FURTHER_TRIES = 2
"""Number of further attempts to carry out a job whose worker was lost."""


def carry_out_jobs(call: Callable[[int], object], indices: Iterable[int], report: Report) -> None:
    """Carries out jobs one after the other; runs in a worker.

    After `MOST_FAILURES` failures in a row no further job is carried out.

    Args:
        call: carries out one job, and returns its result, which can be pickled. A `GearError` is a failure of the job.
        indices: indices of the jobs.
        report: called with the outcome of each job.
    """
    in_row = 0
    for index in indices:
        try:
            value = call(index)
        except GearError as error:
            in_row += 1
            report(Outcome(index=index, kind="failed", error=str(error), is_final=True))
            if in_row >= MOST_FAILURES:
                return
        else:
            in_row = 0
            report(Outcome(index=index, value=value))


def run_jobs(executor: Executor, work: Work, indices: Sequence[int], report: Report) -> dict[int, Outcome]:
    """Carries out jobs with an executor; jobs whose worker was lost are tried again twice.

    Args:
        executor: executor that carries out the jobs.
        work: function that carries out jobs in a worker.
        indices: indices of the jobs.
        report: called in this process with each outcome; a job that is tried again has several.

    Returns:
        The last outcome of each job that failed, by index; jobs that no worker took are among them.

    Raises:
        GearError: a worker raised an error that does not concern a single job.
    """
    failed: dict[int, Outcome] = {}
    ended: set[int] = set()

    def note(outcome: Outcome) -> None:
        ended.add(outcome.index)
        failed.pop(outcome.index, None)
        if outcome.kind == "failed":
            failed[outcome.index] = outcome
        report(outcome)

    left = list(indices)
    for _ in range(1 + FURTHER_TRIES):
        executor.run(work, left, note)
        left = [index for index in left if index in failed and not failed[index].is_final]
    for index in indices:
        if index not in ended:
            note(Outcome(index=index, kind="failed", error="not carried out, because other jobs failed", is_final=True))
    return failed


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
