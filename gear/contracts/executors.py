"""The executor protocol: an engine that makes the missing items of a job, in this process, in several, or on a cluster.

A new engine is one module in `gear/dataset/executors` with a function `executor`, and is called by the module's name;
`gear.testing.executor_contract` tests what is promised here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

MOST_FAILURES = 5
"""Failures in a row after which a worker takes no further items: something other than the items is broken."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one item.

    Attributes:
        index: of the item.
        kind: `made`: all its files are in place; `elsewhere`: another run has made it, or is making it; `failed`.
        error: of a failure, in one line.
        trace: of a failure, the traceback; empty where there is none.
        is_final: of a failure, whether another try can only fail in the same way.
    """

    index: int
    kind: Literal["made", "elsewhere", "failed"] = "made"
    error: str = ""
    trace: str = ""
    is_final: bool = False


Report = Callable[[Outcome], None]
"""Called with the outcome of an item."""

Work = Callable[[Iterator[int], Report], None]
"""Makes the items whose indices it is given, one after the other, and reports one outcome of each. After
`MOST_FAILURES` failures in a row it ends without taking further items. It is a function of a module, or a
`functools.partial` of one, so that it can be sent to another process; what it opens, it opens once."""


class Executor(Protocol):
    """An engine: this process, several processes, a cluster."""

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items. Which worker makes which item changes nothing in its bytes.

        Args:
            work: called once in each worker, or several times with a part of the items.
            indices: of the items that are missing, each to be made once.
            report: called in this process with one outcome for each item, in any order. Items whose worker was lost are
                reported as failed. Items are left out only when all workers have ended after failures.

        Raises:
            GearError: the first one of a worker that is not about a single item.
        """
        ...
