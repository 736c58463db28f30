"""Worker processes: what an engine promises, and workers that end before their work is done."""

from __future__ import annotations

import errno
import os
import signal
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from gear.contracts.executors import MOST_FAILURES, Executor, Outcome, Report
from gear.dataset.executors import processes as workers
from gear.dataset.executors import threads
from gear.dataset.executors.processes import Processes
from gear.testing.executor_contract import ExecutorContract, write_items
from gear.values.errors import BackendError, GearError


class TestProcesses(ExecutorContract):
    @pytest.fixture
    def executor(self) -> Executor:
        return Processes(workers=2, backend="classic")


def die_at(deadly: tuple[int, ...], number: int, indices: Iterator[int], report: Report) -> None:
    """Is killed at some items, as by a lack of memory, or ends with an exit code."""
    for index in indices:
        if index in deadly:
            if number < 0:
                os.kill(os.getpid(), -number)
            os._exit(number)
        report(Outcome(index=index))


def tell_threads(folder: str, indices: Iterator[int], report: Report) -> None:
    for index in indices:
        (Path(folder) / str(index)).write_text(",".join(os.environ.get(name, "") for name in threads.THREADS))
        report(Outcome(index=index))


@pytest.mark.parametrize(("count", "said"), [(2, "4,9,4,4"), (1, ",9,,")])
def test_workers_share_the_cores_unless_the_user_has_set_threads(
    count: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in threads.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv(threads.THREADS[1], "9")
    monkeypatch.setattr(threads, "cores", lambda: 8)
    before = dict(os.environ)
    ran(partial(tell_threads, str(tmp_path)), 2, count)
    assert {path.read_text() for path in tmp_path.iterdir()} == {said}
    assert dict(os.environ) == before


def hang_at(where: int, indices: Iterator[int], report: Report) -> None:
    for index in indices:
        if index == where:
            time.sleep(600)
        report(Outcome(index=index))


def die_at_once(code: int, indices: Iterator[int], report: Report) -> None:
    os._exit(code)


def ran(work: workers.Work, items: int, count: int = 1, silence_s: float = 600.0) -> dict[int, Outcome]:
    reported: dict[int, Outcome] = {}
    run = Processes(workers=count, backend="classic", silence_s=silence_s).run
    run(work, range(items), lambda outcome: reported.update({outcome.index: outcome}))
    return reported


@pytest.mark.parametrize(("number", "code"), [(-signal.SIGKILL, -9), (0, 0), (3, 3)])
def test_a_worker_that_dies_costs_its_item_alone(number: int, code: int) -> None:
    reported = ran(partial(die_at, (1,), number), 4)
    assert {index: outcome.kind for index, outcome in reported.items()} == {
        0: "made", 1: "failed", 2: "made", 3: "made",
    }  # fmt: skip
    assert reported[1].error == f"a worker died (exit code {code})"


def test_workers_that_die_at_every_item_are_replaced_a_few_times_only() -> None:
    reported = ran(partial(die_at, tuple(range(30)), -signal.SIGKILL), 30)
    assert sorted(reported) == list(range(MOST_FAILURES))


def test_a_worker_that_fails_at_every_item_gives_up(tmp_path: Path) -> None:
    reported = ran(partial(write_items, str(tmp_path), tuple(range(30))), 30)
    assert sorted(reported) == list(range(MOST_FAILURES))


@pytest.mark.slow
def test_a_worker_that_hangs_is_ended_and_replaced() -> None:
    reported = ran(partial(hang_at, 1), 3, silence_s=15.0)
    assert {index: outcome.kind for index, outcome in reported.items()} == {0: "made", 1: "failed", 2: "made"}
    assert "no sample for 15 s, the driver seems to hang" in reported[1].error


class OddError(Exception):
    """An error that pickle cannot make again."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(f"{first}\n{second}")


def reach_a_limit(kind: str, indices: Iterator[int], report: Report) -> None:
    for _ in indices:
        if kind == "files":
            raise OSError(errno.EMFILE, "Too many open files")
        if kind == "pipe":
            raise BrokenPipeError(errno.EPIPE, "Broken pipe")
        raise MemoryError if kind == "memory" else OddError("it broke", "here")


@pytest.mark.parametrize(
    ("kind", "error", "said"),
    [
        ("files", OSError, "Too many open files"),
        ("memory", MemoryError, "In a worker"),
        ("pipe", BrokenPipeError, "Broken pipe"),
        ("odd", GearError, "^OddError: it broke$"),
    ],
)
def test_an_error_that_belongs_to_no_item_ends_the_run_unchanged(kind: str, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said) as caught:
        ran(partial(reach_a_limit, kind), 2)
    if kind == "files":
        assert isinstance(caught.value, OSError) and caught.value.errno == errno.EMFILE
        assert "reach_a_limit" in caught.value.__notes__[0], "the worker's traceback"


@pytest.mark.parametrize("code", [0, 1])
def test_a_worker_that_dies_before_its_first_item_ends_the_run(code: int) -> None:
    with pytest.raises(BackendError, match=rf"classic: a worker died \(exit code {code}\).*run the same command again"):
        ran(partial(die_at_once, code), 2)
