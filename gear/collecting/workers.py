"""Several workers: spawned processes that take the next index from a shared counter."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.context import SpawnProcess
from multiprocessing.queues import Queue
from typing import Any

from gear.collecting.job import Job
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import open_session
from gear.dataset.store import Store
from gear.values.errors import BackendError, GearError

SILENCE_S = 600.0
"""A pool that finishes nothing for so long is taken for hung (drivers do hang); slow machines need seconds a sample."""

INTERRUPTED = 130
"""What a worker that was interrupted ends with: its sample is missing."""


def collect_in_processes(job: Job, indices: Sequence[int], workers: int, done: Callable[[int], None]) -> None:
    """As `collect_samples`, shared out among processes. Who makes which sample changes nothing in its bytes.

    Raises:
        GearError: the first one that a worker reports, or that a worker died or hung.
    """
    context = multiprocessing.get_context("spawn")
    reports: Queue[tuple[str, Any]] = context.Queue()
    position = context.Value("q", 0)
    processes = [
        context.Process(target=_work, args=(job, list(indices), position, reports), daemon=True, name=f"gear-{i}")
        for i in range(min(workers, len(indices)))
    ]
    try:
        with _no_interrupts():  # workers inherit that, and are not stopped in the middle of their imports
            for process in processes:
                process.start()
        _listen(job, processes, reports, len(indices), done)
    finally:
        started = [process for process in processes if process.pid is not None]
        for process in started:
            process.terminate()
        for process in started:
            process.join(timeout=10)


@contextlib.contextmanager
def _no_interrupts() -> Iterator[None]:
    """Keeps Ctrl-C waiting, where the system can."""
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        _interrupts_again()


def _interrupts_again() -> None:
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _listen(
    job: Job, processes: list[SpawnProcess], reports: Queue[tuple[str, Any]], total: int, done: Callable[[int], None]
) -> None:
    finished, silent_s = 0, 0.0
    while finished < total:
        have_ended = all(p.exitcode is not None for p in processes)  # asked first: all that they said is there by now
        try:
            kind, content = reports.get(timeout=1.0)
        except queue.Empty:
            silent_s += 1.0
            dead = [p for p in processes if have_ended or p.exitcode not in (None, 0)]
            if dead:
                raise BackendError(
                    job.config.renderer,
                    f"a worker died (exit code {dead[0].exitcode})",
                    "run the same command again: finished samples are kept; fewer --workers need less memory",
                ) from None
            if silent_s >= SILENCE_S:
                raise BackendError(
                    job.config.renderer,
                    f"no sample for {SILENCE_S:g} s, the driver seems to hang",
                    "run the same command again with --workers 1",
                ) from None
            continue
        silent_s = 0.0
        if kind == "error":
            raise content
        finished += 1
        done(content)


def _work(job: Job, indices: list[int], position: Any, reports: Queue[tuple[str, Any]]) -> None:
    """Runs in the worker process."""

    def remaining() -> Iterator[int]:
        while True:
            with position.get_lock():
                taken = position.value
                position.value = taken + 1
            if taken >= len(indices):
                return
            yield indices[taken]

    threading.Thread(target=_follow_parent, daemon=True).start()
    try:
        _interrupts_again()
        with open_session(job) as session:
            collect_samples(session, Store(job.root, job.plan), remaining(), lambda i: reports.put(("done", i)))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)  # nobody hears it where the parent is interrupted, too
    except GearError as error:
        reports.put(("error", _portable(error)))


def _follow_parent() -> None:
    """Ends this process when its parent is gone, killed perhaps: who gives the command again should be alone."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _portable(error: GearError) -> GearError:
    """The error itself where it survives the way to the parent, else its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # unpickling runs the error's own code, which may be a third party's
        return GearError(str(error))
    return error
