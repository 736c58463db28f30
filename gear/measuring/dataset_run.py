"""Evaluates a model on one dataset.

Samples are read in advance and predicted in batches. The metrics and files of one batch are computed while the next
batch is predicted.
"""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Sequence, Set
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from gear.dataset.reading import Dataset
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.parallel_batches import lanes
from gear.measuring.scoring import SampleResult, Scorer
from gear.readers import TorchDataset, read_ahead
from gear.values.errors import DatasetError

SampleDone = Callable[[], None]
"""Type of a callback without arguments that is called after each sample, when all of its files are written."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """The result of a model on one dataset.

    Attributes:
        results: stored result of every sample, in the order of the samples.
        made: number of samples that this run predicted; an earlier run predicted all other samples.
        damaged: one error per stored prediction that could not be read and was predicted again.
    """

    results: list[SampleResult]
    made: int
    damaged: tuple[DatasetError, ...]


def evaluate_row(
    dataset: Dataset[Any], scorer: Scorer, guarded: GuardedModel, *, batch: int, workers: int, done: SampleDone
) -> Row:
    """Evaluates a model on one dataset: reads the predictions of an earlier run and computes the missing ones.

    The rounding of a network depends on the batch size and on the number of threads, and an interrupted run must end
    with the same bytes. Batches therefore always consist of the same samples, including finished ones, and the number
    of lanes (batches that are processed in parallel) depends only on the whole dataset.

    With several lanes, each lane processes its batches completely, from reading to metrics, and further threads write
    the files. With one lane, other threads decode pictures, compute metrics and write files. The number of waiting
    samples is bounded, so memory does not grow with the dataset.

    Args:
        dataset: the dataset.
        scorer: computes metrics and stores results.
        guarded: the model with its defense.
        batch: number of samples per batch.
        workers: number of threads that decode, score and write.
        done: called after each sample, when its files are written.
    """
    items = TorchDataset(dataset)
    with ThreadPoolExecutor(workers) as scorers:
        desk = _BoundedQueue(scorers, 2 * batch + workers, done)
        results, damaged = _taken_up(scorer, desk)
        every = [range(begin, min(begin + batch, len(dataset))) for begin in range(0, len(dataset), batch)]
        blocks = [block for block in every if not results.keys() >= set(block)]
        made = len(dataset) - len(results)
        count = min(guarded.lanes, len(every))
        if count > 1:
            scored = _in_lanes(items, scorer, guarded, blocks, results.keys(), count, desk)
        else:
            scored = {}
            with contextlib.closing(read_ahead(items, blocks, workers=workers)) as reading:
                for read in reading:
                    predictions = guarded.predict([item.sample.images for item in read], [item.index for item in read])
                    for item, prediction in zip(read, predictions, strict=True):
                        if item.index not in results:
                            scored[item.index] = desk.submit(scorer.score_new, item.index, item.sample, prediction)
                    desk.check()
        results |= {index: future.result() for index, future in scored.items()}
    desk.check()  # looked at again now that every callback has ended: that of the last sample may fail too
    return Row(results=[results[index] for index in range(len(dataset))], made=made, damaged=tuple(damaged))


def _in_lanes(
    items: TorchDataset,
    scorer: Scorer,
    guarded: GuardedModel,
    blocks: Sequence[range],
    finished: Set[int],
    count: int,
    desk: _BoundedQueue,
) -> dict[int, Future[SampleResult]]:
    """Processes several batches in parallel, each in one thread up to the writing of its files."""

    def worked_out(indices: Sequence[int]) -> dict[int, Future[SampleResult]]:
        read = [items[index] for index in indices]
        predictions = guarded.predict([item.sample.images for item in read], indices)
        return {
            item.index: desk.submit(scorer.write, scorer.score(item.index, item.sample, prediction))
            for item, prediction in zip(read, predictions, strict=True)
            if item.index not in finished
        }

    written: dict[int, Future[SampleResult]] = {}
    with lanes(count) as submit:
        coming = deque(blocks)
        played: deque[Future[dict[int, Future[SampleResult]]]] = deque()
        while coming or played:
            while coming and len(played) <= count:
                played.append(submit(worked_out, coming.popleft()))
            written |= played.popleft().result()
            desk.check()
    return written


class _BoundedQueue:
    """A bounded queue of samples to measure, which remembers the first failure."""

    def __init__(self, pool: ThreadPoolExecutor, most: int, done: SampleDone) -> None:
        """Args:
        pool: threads that compute metrics and write files.
        most: number of jobs that may wait for a thread.
        done: called after every sample, when all of its files are written.
        """
        self._pool = pool
        self._waiting, self._reporting, self._done = threading.Semaphore(most), threading.Lock(), done
        self._failed = list[BaseException]()

    def submit(self, job: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Adds a job; waits while the queue is full."""
        self._waiting.acquire()
        future = self._pool.submit(job, *arguments)
        future.add_done_callback(self._tell)
        return future

    def check(self) -> None:
        """Raises the first failure of a job, so that the run stops at once."""
        if self._failed:
            raise self._failed[0]

    def _tell(self, done: Future[Any]) -> None:
        self._waiting.release()
        error = None if done.cancelled() else done.exception()
        try:
            if not done.cancelled() and error is None and isinstance(done.result(), SampleResult):
                with self._reporting:
                    self._done()
        except BaseException as problem:  # futures keep what is raised here to themselves
            error = problem
        if error is not None:
            self._failed.append(error)


def _taken_up(scorer: Scorer, desk: _BoundedQueue) -> tuple[dict[int, SampleResult], list[DatasetError]]:
    """The samples that an earlier run finished, and one line for each stored prediction that cannot be read."""
    futures: dict[int, Future[SampleResult | DatasetError]] = {}
    for index in sorted(scorer.finished()):
        futures[index] = desk.submit(scorer.rescore_stored, index)
        desk.check()
    results: dict[int, SampleResult] = {}
    damaged: list[DatasetError] = []
    for index, future in futures.items():
        read = future.result()
        if isinstance(read, SampleResult):
            results[index] = read
        else:
            damaged.append(read)
    return results, damaged
