"""Samples that stay in memory, up to a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gear.readers.in_memory import Kept, bytes_of


@dataclass(frozen=True, eq=False)
class Sample:
    images: dict[str, np.ndarray[Any, Any]]
    depth_m: np.ndarray[Any, Any]
    name: str = ""


class Counting(Sequence[Any]):
    """Ten samples of 100 bytes that count how often they are read."""

    def __init__(self) -> None:
        self.reads: list[int] = []

    def __len__(self) -> int:
        return 10

    def __getitem__(self, index: Any) -> Any:
        self.reads.append(index)
        return Sample({"left": np.zeros(60, np.uint8)}, np.full(10, index, np.float32))


def test_the_size_is_that_of_all_arrays() -> None:
    assert bytes_of(Counting()[0]) == 100


def test_the_first_samples_stay_and_the_rest_is_read_again() -> None:
    source = Counting()
    kept = Kept(source, limit_bytes=350)
    for _ in range(2):
        assert [float(sample.depth_m[0]) for sample in kept] == list(range(10))
    assert source.reads == [*range(10), *range(3, 10)]
    assert kept[0] is kept[-10] and [s.depth_m[0] for s in kept[1:3]] == [1, 2]


def test_without_room_nothing_stays() -> None:
    source = Counting()
    kept = Kept(source, limit_bytes=99)
    assert kept[4] is not kept[4] and source.reads == [4, 4]
