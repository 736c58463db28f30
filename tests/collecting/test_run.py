"""Workers that end before their samples are made."""

from __future__ import annotations

import errno
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from gear.collecting.run import CollectReport
from gear.contracts.executors import Needs
from gear.dataset import locks
from gear.dataset.executors import engines
from gear.values.errors import BackendError


def test_a_disk_without_locks_is_named_once(
    tmp_path: Path, collect_small: Callable[..., CollectReport], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(descriptor: int, operation: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(locks.fcntl, "flock", refuse)
    notes: list[str] = []
    assert collect_small("depth", tmp_path / "a", samples=1, on_warning=notes.append).made == 1
    said = f"{tmp_path / 'a'}: the file system has no locks (No locks available): {locks.SHARED}"
    assert [note for note in notes if "locks" in note] == [said]


@pytest.mark.skipif(sys.platform == "win32", reason="there processes are interrupted otherwise")
def test_interrupted_workers_are_reported_at_once(
    tmp_path: Path, collect_small: Callable[..., CollectReport], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody's `kill -INT`: it took ten minutes of silence, and then the driver was blamed."""
    monkeypatch.setattr(engines, "Needs", lambda: Needs(silence_s=120.0))

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
