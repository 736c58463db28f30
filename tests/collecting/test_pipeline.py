"""One worker's loop: failures of samples are reported, errors of the disk end it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from gear.collecting.pipeline import collect_samples
from gear.contracts.executors import MOST_FAILURES, Outcome
from gear.values.errors import DatasetError, GearError, PlacementError

Raise = Callable[[int], BaseException | None]


class Odd:
    """A session and a store that raise what is asked for, sample by sample."""

    device: ClassVar[dict[str, str]] = {}

    def __init__(self, *, shoot: Raise = lambda _: None, finish: Raise = lambda _: None, write: Raise = lambda _: None):
        self._shoot, self._finish, self._write = shoot, finish, write
        self.has_finished = threading.Event()
        self.written: list[int] = []

    def record(self, index: int) -> int:
        return index

    def shoot(self, index: int) -> int:
        if (error := self._shoot(index)) is not None:
            if index:
                assert self.has_finished.wait(10)
            raise error
        return index

    def finish(self, index: int) -> tuple[int]:
        self.has_finished.set()
        if (error := self._finish(index)) is not None:
            raise error
        return (index,)

    def write(self, index: int, *, device: dict[str, str]) -> None:
        assert device is self.device
        if (error := self._write(index)) is not None:
            raise error
        self.written.append(index)


def outcomes(session: Any, count: int) -> list[Outcome]:
    reported: list[Outcome] = []
    collect_samples(session, session, iter(range(count)), reported.append)
    return reported


def at(*indices: int, error: BaseException) -> Raise:
    return lambda index: error if index in indices else None


@pytest.mark.parametrize("stage", ["shoot", "finish"])
def test_a_sample_that_fails_is_reported_in_order_and_the_others_are_made(stage: str) -> None:
    session = Odd(**{stage: at(1, 3, error=KeyError("boom"))})
    reported = outcomes(session, 5)
    assert [outcome.index for outcome in reported] == [0, 1, 2, 3, 4] and session.written == [0, 2, 4]
    assert [outcome.kind for outcome in reported] == ["made", "failed", "made", "failed", "made"]
    assert reported[1].error == "KeyError: 'boom'" and "Traceback" in reported[1].trace and not reported[1].is_final


def test_a_gear_error_is_reported_with_its_text_and_a_lack_of_place_is_final() -> None:
    assert outcomes(Odd(finish=at(0, error=GearError("no answer"))), 1)[0].error == "no answer"
    assert outcomes(Odd(shoot=at(0, error=PlacementError("board", "too tight"))), 1)[0].is_final


def test_a_worker_gives_up_after_failures_in_a_row() -> None:
    reported = outcomes(Odd(shoot=lambda index: ValueError() if index > 2 else None), 30)
    assert [outcome.index for outcome in reported] == list(range(3 + MOST_FAILURES))
    spread = outcomes(Odd(finish=lambda index: ValueError() if index % 5 else None), 30)
    assert len(spread) == 30, "four in a row are not enough"


@pytest.mark.parametrize("second", [DatasetError("b", "no disk"), KeyError("boom"), None])
def test_of_an_error_of_the_disk_and_another_the_first_samples_is_raised(second: Exception | None) -> None:
    shoot: Raise = (lambda _: None) if second is None else at(1, error=second)
    session = Odd(shoot=shoot, write=at(0, error=DatasetError("a", "the disk is full")))
    with pytest.raises(DatasetError, match="a: the disk is full"):
        outcomes(session, 3)
    assert session.written in ([], [1]) and 2 not in session.written


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), MemoryError()])
def test_a_limit_of_the_machine_is_no_failure_of_a_sample(error: Exception) -> None:
    with pytest.raises(type(error)):
        outcomes(Odd(shoot=at(0, error=error)), 2)


def test_an_interrupt_stays_one_whatever_failed_before() -> None:
    session = Odd(shoot=at(1, error=KeyboardInterrupt()), finish=at(0, error=DatasetError("a", "the disk is full")))
    with pytest.raises(KeyboardInterrupt):
        outcomes(session, 3)
