"""The loop of one worker: the next scene is rendered while the last one is measured, encoded and written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from gear.collecting.session import Session, Shot
from gear.dataset.store import Store

IN_FLIGHT = 2
"""Frames that may wait for the writer; more would cost memory and save no time."""


def collect_samples(session: Session, store: Store, indices: Iterable[int], done: Callable[[int], None]) -> None:
    """Makes and writes samples; `done` is called when the last file of a sample is in place.

    Raises:
        GearError: the first error; finished samples stay. Of two errors at once, that of the earlier sample.
    """
    waiting: deque[tuple[int, Future[None]]] = deque()

    def settle(most: int) -> None:
        while len(waiting) > most:
            index, future = waiting[0]
            future.result()
            waiting.popleft()
            done(index)

    with ThreadPoolExecutor(max_workers=1, thread_name_prefix="gear-writer") as writer:
        try:
            for index in indices:
                shot = session.shoot(session.record(index))
                settle(IN_FLIGHT - 1)
                waiting.append((index, writer.submit(_write, session, store, shot)))
            settle(0)
        except BaseException as error:
            writer.shutdown(wait=True, cancel_futures=True)
            if isinstance(error, Exception):  # an interrupt stays one
                for _, future in waiting:
                    if not future.cancelled():
                        future.result()
            raise


def _write(session: Session, store: Store, shot: Shot) -> None:
    store.write(*session.finish(shot))
