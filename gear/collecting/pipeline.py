"""The loop of one worker: a scene is rendered while the previous one is measured, encoded and written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from gear.collecting.session import Session, Shot
from gear.dataset.store import Store

IN_FLIGHT = 2
"""Number of frames that may wait for the writer; more would need memory and save no time."""


def collect_samples(session: Session, store: Store, indices: Iterable[int], done: Callable[[int], None]) -> None:
    """Makes and writes samples; `done` is called when all files of a sample are written.

    Raises:
        GearError: a sample cannot be made or written; finished samples are kept. If two samples fail at once, the error
            of the earlier one.
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
