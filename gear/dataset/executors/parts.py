"""What engines of several machines have in common: the items go out in parts, and the outcomes of a part come back."""

from __future__ import annotations

from collections.abc import Sequence

from gear.contracts.executors import Outcome, Report, Work
from gear.values.errors import GearError

LARGEST = 64
"""Items of a part at most: a part opens its world and renderer once, and its progress is reported when it ends."""

PARTS_PER_WORKER = 4
"""Parts for each worker at least, so that the last worker does not work alone for long."""


def split_in_parts(indices: Sequence[int], workers: int) -> list[list[int]]:
    """Splits items into parts of neighbours, so that frames of one sequence are mostly in the same part."""
    size = max(1, min(LARGEST, len(indices) // (workers * PARTS_PER_WORKER)))
    return [list(indices[start : start + size]) for start in range(0, len(indices), size)]


def run_part(work: Work, indices: Sequence[int]) -> list[Outcome] | str:
    """Makes one part; runs on the worker's machine.

    Returns:
        The outcomes, or the text of an error that is not about a single item.
    """
    outcomes: list[Outcome] = []
    try:
        work(iter(indices), outcomes.append)
    except GearError as error:
        return str(error)
    return outcomes


def report_part(result: list[Outcome] | str, report: Report) -> bool:
    """Reports the outcomes of a part.

    Returns:
        Whether any item of the part was made, here or elsewhere.

    Raises:
        GearError: the part ended with an error that is not about a single item.
    """
    if isinstance(result, str):
        raise GearError(result)
    for outcome in result:
        report(outcome)
    return any(outcome.kind != "failed" for outcome in result)


def report_lost(indices: Sequence[int], problem: str, report: Report) -> None:
    """Reports the items of a part as failed, whose worker was lost."""
    for index in indices:
        report(Outcome(index=index, kind="failed", error=problem))
