"""The contract of loggers: a logger that keeps its entries in memory passes, and broken ones fail."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from gear.contracts.loggers import LoggedRun
from gear.contracts.specs import LoggerSpec
from gear.testing.logger_contract import LoggerContract


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the logger of this test."""

    project: str = "gear"


class InMemory:
    """Keeps entries in a list."""

    def __init__(self, config: Options) -> None:
        self.entries: list[Any] = []

    def open(self, run: LoggedRun) -> InMemory:
        return self

    def scalar(self, name: str, value: float, step: int) -> None:
        self.entries.append((name, value, step))

    def picture(self, name: str, rgb: Any, step: int) -> None:
        self.entries.append((name, rgb.copy(), step))

    def text(self, name: str, text: str, step: int) -> None:
        self.entries.append((name, text, step))

    def flush(self) -> None:
        return

    def close(self) -> None:
        return


in_memory = LoggerSpec(name="in_memory", summary="Keeps entries.", config=Options, build=InMemory)


class TestInMemory(LoggerContract):
    spec = in_memory
    options = {"project": "other"}  # noqa: RUF012


class Scribbling(InMemory):
    """Draws into the pictures."""

    def picture(self, name: str, rgb: Any, step: int) -> None:
        rgb[0] = 0


class Drawing(InMemory):
    """Names its entries at random."""

    def scalar(self, name: str, value: float, step: int) -> None:
        random.random()


class Choosy(InMemory):
    """Refuses values that are not finite."""

    def scalar(self, name: str, value: float, step: int) -> None:
        assert abs(value) < 1e9


@pytest.mark.parametrize(
    ("kind", "promise"),
    [
        (Scribbling, "test_inputs_are_left_alone"),
        (Drawing, "test_random_generators_are_left_alone"),
        (Choosy, "test_entries_of_every_kind_are_taken"),
    ],
)
def test_a_broken_logger_is_found(kind: Any, promise: str, tmp_path: Path) -> None:
    spec = LoggerSpec(name="broken", summary="Broken.", config=Options, build=kind)
    contract = type("Broken", (LoggerContract,), {"spec": spec})()
    with pytest.raises(AssertionError):
        getattr(contract, promise)(tmp_path)
