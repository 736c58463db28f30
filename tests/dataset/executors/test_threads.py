"""Threads of workers."""

from __future__ import annotations

import os

import pytest

from gear.dataset.executors import threads
from gear.dataset.executors.threads import THREADS, share_of, thread_variables, threads_set


@pytest.mark.parametrize(("workers", "share"), [(1, None), (2, 4), (3, 2), (20, 1)])
def test_workers_share_the_cores(workers: int, share: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "cores", lambda: 8)
    assert share_of(workers) == share


def test_variables_of_the_user_keep_their_values(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("LP_NUM_THREADS", "7")
    before = dict(os.environ)
    wanted = {**dict.fromkeys(THREADS, "2"), "LP_NUM_THREADS": "7"}
    assert thread_variables(2) == wanted
    with threads_set(2):
        assert {name: os.environ[name] for name in THREADS} == wanted
    with threads_set(None):
        assert dict(os.environ) == before
    assert dict(os.environ) == before
