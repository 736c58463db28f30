"""The protocol of executors. An executor is an engine that makes the missing items of a job, in this process, in
several, or on a cluster.

A new engine is one module in `gear/dataset/executors` with a function `executor`; the engine's name is the module's
name. `gear.testing.executor_contract` tests the contract.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

MOST_FAILURES = 5
"""Number of consecutive failures after which a worker takes no further items, because the cause then lies not in a
single item.
"""


SILENCE_S = 600.0
"""Seconds without a message after which a worker that makes samples counts as hung. Graphics drivers can hang, and even
slow machines need less than a minute per sample.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What the work of one worker needs from the engine.

    Attributes:
        silence_s: longest time of an item in seconds; a worker without a message for this time counts as hung.
        gpus: number of graphics cards that the engine reserves for each worker, if the engine can reserve them.
    """

    silence_s: float = SILENCE_S
    gpus: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The outcome of one item, such as a sample: made, failed, or made by another run; or a report before its end.

    Attributes:
        index: index of the item.
        kind: `made` if all its files are written; `elsewhere` if another run has made it or is making it; `underway`
            for a report on the progress of an item that has not ended; otherwise `failed`.
        error: the error of a failure, in one line.
        trace: the traceback of a failure; empty if there is none.
        is_final: whether another attempt would fail in the same way.
        value: a small result of the item that can be pickled, for the process that runs the executor; None for samples,
            whose results are files.
    """

    index: int
    kind: Literal["made", "elsewhere", "failed", "underway"] = "made"
    error: str = ""
    trace: str = ""
    is_final: bool = False
    value: object = None


Report = Callable[[Outcome], None]
"""Type of the function that is called with the outcome of each item."""

Work = Callable[[Iterator[int], Report], None]
"""Type of a function that makes the items with the given indices one after the other, and reports one outcome for
each, which reports of the kind `underway` may precede. After `MOST_FAILURES` consecutive failures the function ends
without taking further items. It can be pickled and sent to another process, and opens its resources once for all items.
"""


class Executor(Protocol):
    """An engine that distributes items over workers, such as the calling process, several processes, or a cluster."""

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items with the given indices. The bytes of an item do not depend on the worker that makes it.

        Args:
            work: called once in each worker, or several times with a part of the items.
            indices: indices of the missing items; each is made once.
            report: called in this process with one outcome for each item, in any order; reports of the kind `underway`
                are passed on by engines that get them before the item ends. Items whose worker was lost are reported as
                failed. Items are left out only when all workers have ended after failures.

        Raises:
            GearError: a worker raised an error that does not concern a single item.
        """
        ...
