"""The contract of an engine that makes the missing items of a job, and the engine that is this process itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

Done = Callable[[int], None]
"""Called with the index of an item when its last file is in place."""

Work = Callable[[Iterator[int], Done], None]
"""Makes the items whose indices it is given, one after the other, and reports each finished one. It is a function of a
module, or a `functools.partial` of one, so that it can be sent to another process; what it opens, it opens once."""


class Executor(Protocol):
    """An engine: this process, several processes, a cluster."""

    def run(self, work: Work, indices: Sequence[int], done: Done) -> None:
        """Makes all items. Which worker makes which item changes nothing in its bytes.

        Args:
            work: called once in each worker.
            indices: of the items that are missing, each to be made once.
            done: called in this process, in the order in which items are finished.

        Raises:
            GearError: the first one of a worker, or a worker died or hung. What was finished before it stays.
        """


class InThisProcess:
    """One worker, which is the calling process."""

    def run(self, work: Work, indices: Sequence[int], done: Done) -> None:
        """As `Executor.run`."""
        if indices:
            work(iter(indices), done)
