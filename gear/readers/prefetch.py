"""Reads samples in threads while earlier samples are processed."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Generator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Protocol, TypeVar

T = TypeVar("T")
Given = TypeVar("Given", covariant=True)


class ByNumber(Protocol[Given]):
    """Anything that returns an item for an index: a sequence of samples, or a `TorchDataset`."""

    def __getitem__(self, index: int, /) -> Given: ...


def read_ahead(samples: ByNumber[T], blocks: Sequence[Sequence[int]], *, workers: int) -> Generator[list[T]]:
    """Yields the samples of one block after another, in order, while threads read the next samples.

    The threads read one block in advance, or as many samples as there are threads if that is more. Memory therefore
    does not grow with the split. Closing the iterator ends the threads.

    Args:
        samples: an opened split, or a `TorchDataset` to get its items.
        blocks: indices of the samples of each block.
        workers: number of threads; the result does not depend on it.

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
