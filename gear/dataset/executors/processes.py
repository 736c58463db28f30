"""The engine `processes`: several processes on this machine, each of which requests one item (sample) after
another.

Each worker has its own pipe. A queue or counter shared by all workers could stay locked if one worker is killed, and
the other workers would wait forever.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from gear.contracts.executors import MOST_FAILURES, SILENCE_S, Executor, Needs, Outcome, Report, Work
from gear.dataset.executors.threads import share_of, threads_set
from gear.values.errors import BackendError, GearError, WorkerInterruptedError

T = TypeVar("T")

INTERRUPTED = 130
"""Exit code of a worker process that was interrupted by Ctrl-C."""

AGAIN = "run the same command again: finished samples are kept"


@dataclass(slots=True, kw_only=True, eq=False)
class _Worker:
    """One worker process, as its parent knows it.

    Attributes:
        process: the process.
        pipe: the parent's end of its pipe.
        held: indices of the items that it has taken and not reported.
        has_taken: whether it has asked for an item.
        heard_s: time of its last message, on the monotonic clock.
    """

    process: SpawnProcess
    pipe: Connection
    held: list[int] = field(default_factory=list)
    has_taken: bool = False
    heard_s: float = field(default_factory=time.monotonic)


@dataclass(frozen=True, slots=True, kw_only=True)
class Processes:
    """An executor with several worker processes on this machine.

    Attributes:
        workers: number of worker processes.
        backend: name of the renderer, for messages about workers that died or hang.
        silence_s: seconds without a message after which a worker counts as hung.
    """

    workers: int
    backend: str
    silence_s: float = SILENCE_S

    def run(self, work: Work, indices: Sequence[int], report: Report) -> None:
        """Makes all items (samples of a split). A worker that dies or hangs is replaced, and its items are
        reported as failed.

        Args:
            work: function that makes items in a worker process.
            indices: indices of the items.
            report: called in this process with the outcome of each item.

        Raises:
            Exception: the first one that ends a worker's work, such as a `GearError` or a full table of open files.
            BackendError: a worker died or hung before its first item, or was interrupted.
        """
        count = min(self.workers, len(indices))
        pool = _Pool(asked=self, work=work, pending=deque(indices), report=report, count=count)
        try:
            for _ in range(count):
                pool.start()
            pool.listen()
        finally:
            pool.stop()


def executor(*, workers: int, backend: str, address: str | None, needs: Needs) -> Executor:
    """Opens the engine `processes`, which runs on this machine only and reserves no graphics cards.

    Args:
        workers: number of worker processes.
        backend: name of the renderer, for messages about workers that died or hang.
        address: must be None, because this engine uses no cluster.
        needs: `silence_s` is the time in seconds without a message after which a worker counts as hung; `gpus` is
            ignored.

    Raises:
        GearError: an address is given.
    """
    if address is not None:
        raise GearError("--address is for engines of several machines; name one with --engine ray or --engine slurm")
    return Processes(workers=workers, backend=backend, silence_s=needs.silence_s)


@dataclass(slots=True, kw_only=True, eq=False)
class _Pool:
    """The worker processes of one run.

    Attributes:
        asked: the executor, with the renderer's name for error messages.
        work: function that makes items in a worker process.
        pending: indices that no worker has taken.
        report: called in this process with the outcome of each item.
        count: number of workers that run at a time.
        workers: workers that are running.
        deaths: number of workers that died since the last item was made.
    """

    asked: Processes
    work: Work
    pending: deque[int]
    report: Report
    count: int
    workers: list[_Worker] = field(default_factory=list)
    deaths: int = 0

    def start(self) -> None:
        """Starts a worker."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        name = f"gear-{len(self.workers)}"
        process = context.Process(target=_work, args=(self.work, theirs), name=name)  # no daemon: it may have workers
        if sys.platform != "win32":
            # multiprocessing starts its resource tracker with the first process, which unblocks SIGINT. Started here,
            # it leaves the mask below as it is.
            resource_tracker.ensure_running()
        # The worker inherits the mask, so that Ctrl-C does not stop it amid its imports.
        with _no_interrupts(), threads_set(share_of(self.count)):
            process.start()
            theirs.close()  # so that the pipe ends with the worker
            self.workers.append(_Worker(process=process, pipe=ours))

    def listen(self) -> None:
        """Serves the workers until all have ended.

        Raises:
            Exception: as `Processes.run`.
        """
        while self.workers:
            by_pipe: dict[Any, _Worker] = {worker.pipe: worker for worker in self.workers}
            for pipe in wait(list(by_pipe), timeout=1.0):
                worker = by_pipe[pipe]
                try:
                    message = worker.pipe.recv()
                except (EOFError, OSError):
                    self._ended(worker)
                else:
                    worker.heard_s = time.monotonic()
                    self._answer(worker, message)
            for worker in [one for one in self.workers if time.monotonic() - one.heard_s > self.asked.silence_s]:
                self._lost(worker, f"no sample for {self.asked.silence_s:g} s, the driver seems to hang")

    def _answer(self, worker: _Worker, message: Any) -> None:
        if isinstance(message, Exception):
            raise message
        if message is None:  # it asks for an item
            worker.has_taken = True
            index = self.pending.popleft() if self.pending else None
            if index is not None:
                worker.held.append(index)
            with contextlib.suppress(OSError):  # it died meanwhile, which ends its pipe
                worker.pipe.send(index)
            return
        assert isinstance(message, Outcome)
        if message.kind != "underway":
            worker.held.remove(message.index)
            self.deaths = self.deaths if message.kind == "failed" else 0
        self.report(message)

    def _ended(self, worker: _Worker) -> None:
        """Handles a worker that has closed its pipe: it has no more to do, gave up, or died."""
        worker.process.join(timeout=10)
        code = worker.process.exitcode
        if code == INTERRUPTED:
            raise WorkerInterruptedError(self.asked.backend, f"a worker died (exit code {code})", AGAIN)
        if code == 0 and not worker.held and worker.has_taken:
            self.workers.remove(worker)
            return
        self._lost(worker, f"a worker died (exit code {code})")

    def _lost(self, worker: _Worker, problem: str) -> None:
        """Reports the items of a worker that died or hung as failed, and starts another worker for the pending
        items.

        Raises:
            BackendError: the worker had taken no item.
        """
        if not worker.has_taken:
            raise BackendError(self.asked.backend, problem, f"{AGAIN}; with fewer --workers more memory is free")
        worker.process.kill()
        self.workers.remove(worker)
        self.deaths += 1
        for index in worker.held:
            self.report(Outcome(index=index, kind="failed", error=problem))
        if self.pending and self.deaths < MOST_FAILURES:
            self.start()

    def stop(self) -> None:
        """Ends the workers that still run."""
        for worker in self.workers:
            worker.process.terminate()
        for worker in self.workers:
            worker.process.join(timeout=10)
            worker.pipe.close()


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


def _work(work: Work, pipe: Connection) -> None:
    """Runs in the worker process."""

    def remaining() -> Iterator[int]:
        while True:
            _or_exit(lambda: pipe.send(None))
            index = _or_exit(pipe.recv)
            if index is None:
                return
            yield index

    def report(outcome: Outcome) -> None:
        _or_exit(lambda: pipe.send(outcome))

    threading.Thread(target=_follow_parent, daemon=True).start()
    try:
        _interrupts_again()
        work(remaining(), report)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)  # the parent may be interrupted too, and read no report
    except Exception as error:
        portable = _portable(error)
        _or_exit(lambda: pipe.send(portable))


def _or_exit(talk: Callable[[], T]) -> T:
    """Talks to the parent; ends this process if the parent has ended, or has given this worker up."""
    try:
        return talk()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        sys.exit(1)


def _follow_parent() -> None:
    """Ends this process when its parent has ended: no worker may write beside a second run of the same command."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _portable(error: Exception) -> Exception:
    """The error itself if it can be pickled for the parent, else a `GearError` with its text.

    One that is a bug carries its traceback as a note, since pickling loses it.
    """
    if not isinstance(error, GearError):
        error.add_note("In a worker:\n" + "".join(traceback.format_exception(error)).rstrip())
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # unpickling runs the error's own code, which may be a third party's
        lines = str(error).strip().splitlines()
        text = lines[0] if lines else ""
        return GearError(text if isinstance(error, GearError) else f"{type(error).__name__}: {text}")
    return error
