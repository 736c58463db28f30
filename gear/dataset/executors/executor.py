"""The contract of engines, which make the missing items of a job, and the engine that uses the calling process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

Done = Callable[[int], None]
"""Called with the index of an item when all of its files are written."""

Work = Callable[[Iterator[int], Done], None]
"""A function that makes the items with the given indices, one after the other, and reports each finished one. It can be
pickled, so that it can be sent to another process. Resources are opened once for all items.
"""


class Executor(Protocol):
    """An engine, such as the calling process, several processes, or a cluster."""

    def run(self, work: Work, indices: Sequence[int], done: Done) -> None:
        """Makes all items. The bytes of an item do not depend on the worker.

        Args:
            work: called once in each worker.
            indices: indices of the missing items; each is made once.
            done: called in the calling process, in the order in which items are finished.

        Raises:
            GearError: a worker raised an error, died or hung. Finished items are kept.
        """


class InThisProcess:
    """One worker, which is the calling process."""

    def run(self, work: Work, indices: Sequence[int], done: Done) -> None:
        """Runs all items; see `Executor.run`."""
        if indices:
            work(iter(indices), done)
