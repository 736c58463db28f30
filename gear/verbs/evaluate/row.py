"""One dataset through the model: read ahead, predicted in batches, measured and written beside the next batch."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from gear.dataset.reading import Dataset
from gear.verbs.evaluate.lanes import lanes
from gear.verbs.evaluate.player import Answer, Player
from gear.verbs.evaluate.scoring import Note, Scorer

Told = Callable[[], None]
"""Called after every sample that is whole."""


def evaluate_row(
    dataset: Dataset[Any], scorer: Scorer, player: Player, *, batch: int, workers: int, told: Told
) -> tuple[list[Note], int]:
    """Every sample's note, in order, and how many of them were predicted now.

    Pictures are decoded and predictions measured and written in threads, while the model works on a batch, or on one in
    each of its lanes; what waits is bounded, so memory does not grow with the dataset.
    """
    kept = scorer.kept()
    missing = [index for index in range(len(dataset)) if index not in kept]
    notes: dict[int, Future[Note]] = {}
    count = min(player.lanes, -(-len(missing) // batch)) or 1
    waiting, one_tells, failed = threading.Semaphore(2 * batch + workers), threading.Lock(), list[BaseException]()

    def tell(done: Future[Note]) -> None:
        waiting.release()
        error = None if done.cancelled() else done.exception()
        try:
            if not done.cancelled() and error is None:
                with one_tells:
                    told()
        except BaseException as problem:  # futures keep what is raised here to themselves
            error = problem
        if error is not None:
            failed.append(error)

    def play(indices: Sequence[int], samples: Sequence[Any]) -> dict[int, Future[Note]]:
        answers: Sequence[Answer] = player.play([sample.images for sample in samples], indices)
        scored = {}
        for index, sample, answer in zip(indices, samples, answers, strict=True):
            waiting.acquire()
            scored[index] = scorers.submit(scorer.first, index, sample, answer)
            scored[index].add_done_callback(tell)
        return scored

    with (
        ThreadPoolExecutor(workers) as readers,
        ThreadPoolExecutor(workers) as scorers,
        lanes(count) as submit,
    ):
        try:
            for index in sorted(kept):
                waiting.acquire()
                notes[index] = scorers.submit(scorer.again, index)
                notes[index].add_done_callback(tell)
            played: deque[Future[dict[int, Future[Note]]]] = deque()
            for indices, samples in _batches(dataset, missing, readers, batch, workers):
                played.append(submit(play, indices, samples))
                if len(played) > count:
                    notes |= played.popleft().result()
                if failed:  # a sample that failed stops the run now, not at its end
                    raise failed[0]
            for one in played:
                notes |= one.result()
            done = [notes[index].result() for index in range(len(dataset))]
        except BaseException:
            readers.shutdown(wait=False, cancel_futures=True)
            scorers.shutdown(wait=False, cancel_futures=True)
            raise
    if failed:  # looked at again now that every callback has ended: that of the last sample may fail too
        raise failed[0]
    return done, len(missing)


def _batches(
    dataset: Dataset[Any], indices: Sequence[int], readers: ThreadPoolExecutor, batch: int, ahead: int
) -> Iterator[tuple[list[int], list[Any]]]:
    """Batches of samples in order, the next one being read while this one is worked on."""
    coming = iter(indices)
    queue: deque[tuple[int, Future[Any]]] = deque()

    def read_on(count: int) -> None:
        for _, index in zip(range(count), coming, strict=False):
            queue.append((index, readers.submit(dataset.__getitem__, index)))

    read_on(batch + max(batch, ahead))
    while queue:
        chosen = [queue.popleft() for _ in range(min(batch, len(queue)))]
        samples = [future.result() for _, future in chosen]
        read_on(len(chosen))
        yield [index for index, _ in chosen], samples
