"""Makes the missing samples of a split: shares the work with other runs, and retries samples that failed."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from gear.collecting.job import Job
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import open_session
from gear.contracts.executors import MOST_FAILURES, Executor, Outcome, Report
from gear.dataset.claims import Claims
from gear.dataset.disk_and_time_forecast import Forecast
from gear.dataset.executors.processes import Processes
from gear.dataset.failures import clear_failures, failures_folder, note_failure, noted_failures
from gear.dataset.files import inside
from gear.dataset.layout import sidecar_path
from gear.dataset.sharding.shards import Shard
from gear.dataset.sidecar import read_sidecar
from gear.dataset.store import Store
from gear.values.counted import counted
from gear.values.errors import BackendError, DatasetError, SamplesFailedError, WorkerInterruptedError
from gear.values.progress import Callbacks

FRESH_TRIES = 2
"""Number of further attempts to make a sample that failed, each in a new process."""

MOST_IDLE = 8
"""Number of rounds in a row without a new sample in this machine's dataset after which a run ends. The pauses between
them add up to a minute, since a network disk may show another machine's files that late.
"""

SILENT_S = 10.0
"""Seconds of waiting for other runs after which the run says for whom it waits."""

POLL_S = 0.5
"""Seconds between two checks of the samples that other runs are making."""


def collect_missing(job: Job, store: Store, part: Shard, executor: Executor, callbacks: Callbacks) -> int:
    """Makes the missing samples of a shard, and waits for samples that other runs are making.

    Args:
        job: the collection job.
        store: writer of the split's files.
        part: the part of the split that this run collects.
        executor: executor that makes the samples.
        callbacks: callbacks that receive progress and warnings.

    Returns:
        Number of samples that this run has made.

    Raises:
        SamplesFailedError: some samples could not be made; the errors are written into the dataset.
        GearError: no sample can be made, or a file cannot be written.
    """
    making = _Making(job=job, store=store, part=part, executor=executor, callbacks=callbacks)
    try:
        making.run()
    finally:
        making.note_failures()
    making.raise_failures()
    return making.made


@dataclass(slots=True, kw_only=True, eq=False)
class _Making:
    """One run over the missing samples of a shard.

    Attributes:
        job, store, part, executor, callbacks: arguments of `collect_missing`.
        made: number of samples that this run has made.
        failed: the last outcome of each sample that could not be made, by index.
        tries: how often this run has tried each sample that failed, by index.
        gave_up: whether the workers have ended after failures, before all samples were tried.
    """

    job: Job
    store: Store
    part: Shard
    executor: Executor
    callbacks: Callbacks
    made: int = 0
    failed: dict[int, Outcome] = field(default_factory=dict)
    tries: dict[int, int] = field(default_factory=dict)
    gave_up: bool = False

    def run(self) -> None:
        """Makes the samples.

        Raises:
            GearError: as `collect_missing`.
        """
        pending = self.store.missing(self.part)
        total = len(self.store.indices(self.part))
        noted = noted_failures(self.store.root, self.store.split)
        forecast = Forecast(self.store.root, len(pending), self.callbacks.on_warning)
        finished = total - len(pending)
        self.callbacks.on_progress(finished, total)

        def report(outcome: Outcome) -> None:
            nonlocal finished
            index = outcome.index
            if outcome.kind == "failed":
                self.tries[index] = self.tries.get(index, 0) + 1
                self.failed[index] = outcome
                return
            self.failed.pop(index, None)
            if outcome.kind == "made":
                self.made += 1
                finished += 1
                if index in noted:
                    clear_failures(self.store.root, self.store.split, [index])
                self.callbacks.on_progress(finished, total)
                if inside(self.store.root, sidecar_path(self.store.split, index)).exists():  # a network disk lags
                    forecast.item_done(partial(bytes_of, self.store, index))

        idle = 0
        while pending:
            before = set(pending)
            self._try_all(pending, report)
            self._try_again(report)
            if self.gave_up:
                return
            pending = self._wait_for_others()
            idle = idle + 1 if before == set(pending) else 0
            if idle:
                self._pause(idle)
            there = total - len(self.store.missing(self.part))
            if there > finished:
                finished = there
                self.callbacks.on_progress(finished, total)

    def _pause(self, idle: int) -> None:
        """Waits after a round that has left its samples missing.

        Raises:
            DatasetError: there were too many such rounds.
        """
        if idle >= MOST_IDLE:
            problem = (
                "the workers report samples that do not appear there; engines of several machines need an --out that "
                "all of them share"
            )
            raise DatasetError(self.store.root, problem)
        time.sleep(POLL_S * 2 ** (idle - 1))

    def _try_all(self, pending: Sequence[int], report: Report) -> None:
        """Tries each sample once; those that other runs have claimed are left out."""
        answered: set[int] = set()

        def report_and_count(outcome: Outcome) -> None:
            answered.add(outcome.index)
            report(outcome)
            if outcome.kind == "failed":
                again = "" if outcome.is_final else "; it is tried again at the end"
                self.callbacks.on_warning(f"sample {outcome.index} failed ({outcome.error}){again}")

        self.executor.run(partial(make_samples, self.job), pending, report_and_count)
        self.gave_up = len(answered) < len(set(pending))

    def _try_again(self, report: Report) -> None:
        """Tries the samples that failed again, each in a process of its own, until too many fail in a row."""
        fresh = Processes(workers=1, backend=self.job.config.renderer)
        in_row = 0
        for index in [index for index, outcome in self.failed.items() if not outcome.is_final]:
            for _ in range(FRESH_TRIES - self.tries[index] + 1):
                if in_row >= MOST_FAILURES:
                    self.gave_up = True
                    return
                try:
                    fresh.run(partial(make_samples, self.job), [index], report)
                except WorkerInterruptedError:
                    raise
                except BackendError as error:
                    if index not in self.failed:  # the worker died after it had made the sample
                        break
                    report(replace(self.failed[index], error=f"{self.failed[index].error}; then: {error}"))
                in_row = in_row + 1 if index in self.failed else 0
                if index not in self.failed:
                    break

    def _wait_for_others(self) -> list[int]:
        """Waits while other runs are making all samples that are missing.

        Returns:
            Indices of the samples that a stopped run has left; empty when none is missing but those that failed.
        """
        began_s, has_said = time.monotonic(), False
        with Claims(self.store.root, self.store.split) as claims:
            while missing := [index for index in self.store.missing(self.part) if index not in self.failed]:
                free = [index for index in missing if not claims.is_taken(index)]
                free = [index for index in free if index in set(self.store.missing(self.part))]
                if free:
                    return free
                if not has_said and time.monotonic() - began_s >= SILENT_S:
                    has_said = True
                    self.callbacks.on_warning(
                        f"waiting for {claims.holder(missing[0])}, which is making sample {missing[0]}; "
                        f"{counted(len(missing), 'sample')} left"
                    )
                time.sleep(POLL_S)
        return []

    def note_failures(self) -> None:
        """Notes the samples that could not be made, except those that another run has made meanwhile.

        Raises:
            DatasetError: a note cannot be written or deleted.
        """
        self._forget_made()
        for outcome in self.failed.values():
            note_failure(self.store.root, self.store.split, outcome, self.tries[outcome.index])
        self._forget_made()  # one that the other run made while the notes were written

    def _forget_made(self) -> None:
        """Drops failures, and their notes, of samples that are no longer missing."""
        missing = set(self.store.missing(self.part))
        if made := [index for index in self.failed if index not in missing]:
            clear_failures(self.store.root, self.store.split, made)
            for index in made:
                del self.failed[index]

    def raise_failures(self) -> None:
        """Raises:
        SamplesFailedError: a sample could not be made; the message says which, why, and what to do.
        """
        left = len(self.store.missing(self.part)) - len(self.failed) if self.gave_up else 0
        if not (self.failed or left > 0):
            return
        first, total = min(self.failed, default=None), len(self.store.indices(self.part))
        parts = [f"{len(self.failed)} of {counted(total, 'sample')} of split {self.store.split!r} could not be made"]
        if first is not None:
            parts[0] += f" (sample {first}: {self.failed[first].error})"
        if left > 0:
            parts.append(f"{left} more were not made after {MOST_FAILURES} failures in a row")
        parts.append(f"the errors are noted in {failures_folder(self.store.split)}")
        parts.append("put the cause right and run the same command again, which makes only what is missing")
        raise SamplesFailedError(self.store.root, "; ".join(parts))


def make_samples(job: Job, indices: Iterator[int], report: Report) -> None:
    """Runs in one worker: opens a world and a renderer once, and makes samples with them.

    Args:
        job: the collection job.
        indices: indices of the samples; those that another run has made or claimed are not made.
        report: called with the outcome of each sample.

    Raises:
        GearError: the world or the renderer cannot be opened, or a file cannot be written.
    """
    store = Store(job.root, job.plan)
    with open_session(job) as session, Claims(store.root, store.split) as claims:

        def report_and_release(outcome: Outcome) -> None:
            claims.release(outcome.index)
            report(outcome)

        collect_samples(session, store, claims.unclaimed(indices, report), report_and_release)


def bytes_of(store: Store, index: int) -> int:
    """The number of bytes of a sample's files and of its sidecar.

    Args:
        store: the split.
        index: index of the sample.

    Raises:
        DatasetError: the sidecar cannot be read.
    """
    path = inside(store.root, sidecar_path(store.split, index))
    sidecar = read_sidecar(path)
    return path.stat().st_size + sum(inside(store.root, name).stat().st_size for name in sidecar.files)
