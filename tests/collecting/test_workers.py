"""Workers that end before their work is done."""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gear.collecting import workers
from gear.values.errors import BackendError
from gear.verbs.collect.run import CollectReport

JOB: Any = SimpleNamespace(config=SimpleNamespace(renderer="classic"))


@pytest.mark.skipif(sys.platform == "win32", reason="there processes are interrupted otherwise")
def test_workers_that_are_interrupted_alone_are_told_at_once(
    tmp_path: Path, collect_small: Callable[..., CollectReport], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody's `kill -INT`: it took ten minutes of silence, and then the driver was blamed."""
    monkeypatch.setattr(workers, "SILENCE_S", 20.0)

    def interrupt(finished: int, total: int) -> None:
        for process in multiprocessing.active_children() if finished == 1 else ():
            if process.name.startswith("gear-") and process.pid is not None:
                os.kill(process.pid, signal.SIGINT)

    # A shell's background ignores it, and so would all that is started there.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(BackendError, match=r"a worker died \(exit code 130\).*run the same command again"):
            collect_small("depth", tmp_path / "out", samples=500, workers=2, on_progress=interrupt)
    finally:
        signal.signal(signal.SIGINT, before)


def listen(codes: list[int | None], *reports: tuple[str, Any]) -> list[int]:
    """What is heard of two samples from workers that have ended so."""
    heard: list[int] = []
    said: Any = queue.Queue()
    for report in reports:
        said.put(report)
    processes: list[Any] = [SimpleNamespace(exitcode=code) for code in codes]
    workers._listen(JOB, processes, said, 2, heard.append)
    return heard


def test_a_pool_that_ended_before_its_last_sample_is_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that calls `exit(0)`, for one."""
    monkeypatch.setattr(workers, "SILENCE_S", 3.0)
    with pytest.raises(BackendError, match=r"a worker died \(exit code 0\)"):
        listen([0, 0], ("done", 1))
    assert listen([0, 0], ("done", 1), ("done", 0)) == [1, 0]
    with pytest.raises(BackendError, match="no sample for 3 s"):
        listen([0, None], ("done", 1))  # one that found nothing left to do is no failure
