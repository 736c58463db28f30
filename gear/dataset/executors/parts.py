"""Functions that the engines for several machines share.

They split the items (samples of a split) into parts, make one part, and report its outcomes.
"""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.executors import Outcome, Report, Work
from gear.values.errors import GearError

LARGEST = 64
"""Largest number of items in a part. Each part opens one world and renderer, and reports its progress when it ends."""

PARTS_PER_WORKER = 4
"""Smallest number of parts per worker, if there are enough items, so that all workers end at about the same time."""


def split_in_parts(indices: Sequence[int], workers: int) -> list[list[int]]:
    """Splits items (samples of a split) into parts of consecutive indices, so most frames of a sequence are in the same
    part.

    Args:
        indices: indices of the items, in ascending order.
        workers: number of workers among which the parts are distributed.

    Returns:
        The indices of each part; every worker gets about `PARTS_PER_WORKER` parts, and no part has more than `LARGEST`
        items.
    """
    size = max(1, min(LARGEST, len(indices) // (workers * PARTS_PER_WORKER)))
    return [list(indices[start : start + size]) for start in range(0, len(indices), size)]


def run_part(work: Work, indices: Sequence[int]) -> list[Outcome] | str:
    """Makes the items (samples of a split) of one part; runs on the worker's machine.

    Args:
        work: function that makes items.
        indices: indices of the items of the part.

    Returns:
        One outcome per item, or the text of an error that does not concern a single item. Reports of the kind
        `underway` are dropped, because they would arrive with the end of the part.
    """
    outcomes: list[Outcome] = []

    def report(outcome: Outcome) -> None:
        if outcome.kind != "underway":
            outcomes.append(outcome)

    try:
        work(iter(indices), report)
    except GearError as error:
        return str(error)
    return outcomes


def report_part(result: list[Outcome] | str, report: Report) -> bool:
    """Reports the outcomes of the items (samples of a split) of one part.

    Args:
        result: outcomes of the items, or the text of an error that does not concern a single item.
        report: called with each outcome.

    Returns:
        Whether at least one item was made, by this run or another one.

    Raises:
        GearError: the part ended with an error that does not concern a single item.
    """
    if isinstance(result, str):
        raise GearError(result)
    for outcome in result:
        report(outcome)
    return any(outcome.kind != "failed" for outcome in result)


def report_lost(indices: Sequence[int], problem: str, report: Report, *, trace: str = "") -> None:
    """Reports the items of a part as failed, whose worker was lost.

    Args:
        indices: items of the part.
        problem: why the worker was lost.
        report: called with the outcome of each item.
        trace: text of the traceback; "" if there is none.
    """
    for index in indices:
        report(Outcome(index=index, kind="failed", error=problem, trace=trace))
