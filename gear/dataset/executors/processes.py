"""The engine `processes`: spawned processes on this machine, which take the next index from a shared counter."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.context import SpawnProcess
from multiprocessing.queues import Queue
from typing import Any

from gear.dataset.executors.executor import Done, Executor, Work
from gear.values.errors import BackendError, GearError

SILENCE_S = 600.0
"""Seconds without a finished item after which the workers are considered hung. Graphics drivers can hang, and the
slowest machines need less than a minute per item.
"""

INTERRUPTED = 130
"""Exit code of a worker that was interrupted while it was making an item."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Processes:
    """Several worker processes on this machine.

    Attributes:
        workers: number of processes.
        backend: name of the renderer, which may make a worker die or hang, for error messages.
    """

    workers: int
    backend: str

    def run(self, work: Work, indices: Sequence[int], done: Done) -> None:
        """Runs all items; see `Executor.run`.

        Raises:
            GearError: a worker reported an error.
            BackendError: a worker died or hung.
        """
        context = multiprocessing.get_context("spawn")
        reports: Queue[tuple[str, Any]] = context.Queue()
        position = context.Value("q", 0)
        processes = [
            context.Process(target=_work, args=(work, list(indices), position, reports), daemon=True, name=f"gear-{i}")
            for i in range(min(self.workers, len(indices)))
        ]
        try:
            with _no_interrupts():  # workers inherit the mask, so that Ctrl-C does not stop them amid their imports
                for process in processes:
                    process.start()
            _listen(self.backend, processes, reports, len(indices), done)
        finally:
            started = [process for process in processes if process.pid is not None]
            for process in started:
                process.terminate()
            for process in started:
                process.join(timeout=10)


def executor(*, workers: int, backend: str) -> Executor:
    """Makes the engine; called by `open_engine`."""
    return Processes(workers=workers, backend=backend)


@contextlib.contextmanager
def _no_interrupts() -> Iterator[None]:
    """A context in which Ctrl-C is deferred, if the system supports it."""
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
    backend: str, processes: list[SpawnProcess], reports: Queue[tuple[str, Any]], total: int, done: Done
) -> None:
    finished, silent_s = 0, 0.0
    while finished < total:
        # Read before the queue: what ended workers reported is in it by now.
        have_ended = all(p.exitcode is not None for p in processes)
        try:
            kind, content = reports.get(timeout=1.0)
        except queue.Empty:
            silent_s += 1.0
            dead = [p for p in processes if have_ended or p.exitcode not in (None, 0)]
            if dead:
                raise BackendError(
                    backend,
                    f"a worker died (exit code {dead[0].exitcode})",
                    "run the same command again: finished samples are kept; fewer --workers need less memory",
                ) from None
            if silent_s >= SILENCE_S:
                raise BackendError(
                    backend,
                    f"no sample for {SILENCE_S:g} s, the driver seems to hang",
                    "run the same command again with --workers 1",
                ) from None
            continue
        silent_s = 0.0
        if kind == "error":
            raise content
        finished += 1
        done(content)


def _work(work: Work, indices: list[int], position: Any, reports: Queue[tuple[str, Any]]) -> None:
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
        work(remaining(), lambda index: reports.put(("done", index)))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)  # the parent may be interrupted too, and read no report
    except GearError as error:
        reports.put(("error", _portable(error)))


def _follow_parent() -> None:
    """Ends this process when its parent has ended, so that no worker writes during a second run of the same command."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _portable(error: GearError) -> GearError:
    """The error itself if it can be pickled for the parent, else a `GearError` with its text."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # unpickling runs the error's own code, which may be a third party's
        return GearError(str(error))
    return error
