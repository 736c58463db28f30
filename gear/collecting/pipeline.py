"""The loop of one worker: a sample is rendered while another thread encodes and writes the previous one."""

from __future__ import annotations

import traceback
from collections import deque
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from gear.collecting.session import Session, Shot
from gear.contracts.executors import MOST_FAILURES, Outcome, Report
from gear.dataset.store import Store
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, GearError, PlacementError

IN_FLIGHT = 2
"""Number of rendered samples that may wait for encoding and writing; more would cost memory and save no time."""

NOT_OF_A_SAMPLE = (DatasetError, OSError, MemoryError)
"""Errors of the disk and of the machine's limits, which end the run because they do not concern a single sample."""


def collect_samples(session: Session, store: Store, indices: Iterable[int], report: Report) -> None:
    """Makes and writes samples, and reports the outcome of each.

    After `MOST_FAILURES` failures in a row no further sample is made, because the cause is probably not the samples.

    Args:
        session: world and renderer.
        store: writer of the files.
        indices: indices of the samples.
        report: called when the last file of a sample is written, or when the sample has failed.

    Raises:
        DatasetError, OSError, MemoryError: a file cannot be written, or a limit of the machine is reached; finished
            samples are kept. Of two such errors, the one of the earlier sample is raised.
    """
    waiting: deque[Future[Outcome]] = deque()
    in_row = 0

    def settle(max_waiting: int) -> None:
        while len(waiting) > max_waiting:
            outcome = waiting[0].result()
            waiting.popleft()
            tell(outcome)

    def tell(outcome: Outcome) -> None:
        nonlocal in_row
        in_row = in_row + 1 if outcome.kind == "failed" else 0
        report(outcome)

    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="gear-writer") as writer:
        try:
            for index in indices:
                shot = _shoot(session, index)
                if isinstance(shot, Outcome):
                    settle(0)
                    tell(shot)
                else:
                    settle(IN_FLIGHT - 1)
                    waiting.append(writer.submit(_write, session, store, index, shot))
                if in_row >= MOST_FAILURES:
                    break
            settle(0)
        except BaseException as error:
            writer.shutdown(wait=True, cancel_futures=True)
            if isinstance(error, Exception):  # an interrupt stays one
                for future in waiting:
                    if not future.cancelled():
                        future.result()
            raise


def _shoot(session: Session, index: int) -> Shot | Outcome:
    """The renders of a sample, or its failure."""
    try:
        return session.shoot(session.record(index))
    except Exception as error:
        return _failure(index, error)


def _write(session: Session, store: Store, index: int, shot: Shot) -> Outcome:
    """Measures, encodes and writes a sample.

    Raises:
        DatasetError, OSError, MemoryError: as `collect_samples`.
    """
    try:
        files = session.finish(shot)
    except Exception as error:
        return _failure(index, error)
    store.write(*files, device=session.device)
    return Outcome(index=index)


def _failure(index: int, error: Exception) -> Outcome:
    """The outcome of a sample that failed.

    Raises:
        DatasetError, OSError, MemoryError: it is such an error.
    """
    if isinstance(error, NOT_OF_A_SAMPLE):
        raise error
    text = str(error) if isinstance(error, GearError) else one_line(error)
    trace = "".join(traceback.format_exception(error))
    # A scene is a pure function of its seed: where one has no place for its actors, a second try finds none either.
    return Outcome(index=index, kind="failed", error=text, trace=trace, is_final=isinstance(error, PlacementError))
