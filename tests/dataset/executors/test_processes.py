"""Worker processes that end before their work is done."""

from __future__ import annotations

import queue
from types import SimpleNamespace
from typing import Any

import pytest

from gear.dataset.executors import processes as workers
from gear.values.errors import BackendError


def listen(codes: list[int | None], *reports: tuple[str, Any]) -> list[int]:
    """What is heard of two samples from workers that have ended so."""
    heard: list[int] = []
    said: Any = queue.Queue()
    for report in reports:
        said.put(report)
    ended: list[Any] = [SimpleNamespace(exitcode=code) for code in codes]
    workers._listen("classic", ended, said, 2, heard.append)
    return heard


def test_a_pool_that_ended_before_its_last_sample_is_told_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that calls `exit(0)`, for one."""
    monkeypatch.setattr(workers, "SILENCE_S", 3.0)
    with pytest.raises(BackendError, match=r"a worker died \(exit code 0\)"):
        listen([0, 0], ("done", 1))
    assert listen([0, 0], ("done", 1), ("done", 0)) == [1, 0]
    with pytest.raises(BackendError, match="no sample for 3 s"):
        listen([0, None], ("done", 1))  # one that found nothing left to do is no failure
