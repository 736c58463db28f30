"""One worker's loop: what is told of two failures at once."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from gear.collecting.pipeline import collect_samples
from gear.values.errors import GearError


class Failing:
    """A session and a store: the first sample fails when it is written, before the second one is placed."""

    def __init__(self, second: BaseException | None) -> None:
        self.second = second
        self.first_failed = threading.Event()

    def record(self, index: int) -> int:
        return index

    def shoot(self, index: int) -> int:
        if index == 1 and self.second is not None:
            assert self.first_failed.wait(10)
            raise self.second
        return index

    def finish(self, index: int) -> Any:
        self.first_failed.set()
        raise GearError(f"sample {index}: the disk is full")

    def write(self, *_: Any) -> None:
        pytest.fail("nothing was measured")


@pytest.mark.parametrize("second", [GearError("sample 1: no place"), None])
def test_of_two_failures_the_first_samples_is_told(second: GearError | None) -> None:
    session: Any = Failing(second)
    with pytest.raises(GearError, match="sample 0: the disk is full") as caught:
        collect_samples(session, session, range(3), lambda _: pytest.fail("nothing was finished"))
    assert caught.value.__context__ is second


def test_an_interrupt_stays_one_whatever_failed_before() -> None:
    session: Any = Failing(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        collect_samples(session, session, range(3), lambda _: None)
