"""Samples that are read while earlier ones are worked on."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol, TypeVar

T = TypeVar("T")
Given = TypeVar("Given", covariant=True)


class ByNumber(Protocol[Given]):
    """What gives something for a number: a sequence, or a `TorchDataset`."""

    def __getitem__(self, index: int, /) -> Given: ...


def read_ahead(samples: ByNumber[T], blocks: Sequence[Sequence[int]], *, workers: int) -> Generator[list[T]]:
    """The samples of one block after the other, in order.

    Threads read on meanwhile: the next block, or as many samples as there are threads. What waits is bounded, so
    memory does not grow with the split. Close the iterator to end its threads.

    Args:
        samples: an opened split, or a `TorchDataset` for its items.
        blocks: indices that are wanted together.
        workers: threads; they change nothing but time.

    Raises:
        DatasetError: a sample cannot be read.
    """
    coming = (index for block in blocks for index in block)
    queue: deque[Future[T]] = deque()
    with ThreadPoolExecutor(workers, thread_name_prefix="gear-read") as readers:

        def read_on(count: int) -> None:
            for index in itertools.islice(coming, count):
                queue.append(readers.submit(samples.__getitem__, index))

        try:
            most = max(map(len, blocks), default=0)
            read_on(most + max(most, workers))
            for block in blocks:
                found = [queue.popleft().result() for _ in block]
                read_on(len(block))
                yield found
        except BaseException:
            readers.shutdown(wait=False, cancel_futures=True)
            raise
