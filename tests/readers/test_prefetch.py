"""Reading ahead, and what stays in memory, over samples that count how often they are read."""

from __future__ import annotations

import contextlib
import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from gear.readers import Kept, TorchDataset, read_ahead


@dataclass
class Numbered:
    images: dict[str, Any]
    number: int


class Numbers:
    """Samples that say their number; the earlier of two takes longer to read."""

    def __init__(self, count: int, broken: int = -1) -> None:
        self.count, self.broken, self.reads = count, broken, [0] * count

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, index: Any) -> Numbered:
        if index == self.broken:
            raise OSError(f"sample {index} is broken")
        time.sleep(0.005 * (index % 2 == 0))
        self.reads[index] += 1
        return Numbered(images={"left": np.full((32, 32, 3), index, np.uint8)}, number=index)


BLOCKS = [range(3), range(6, 9), range(9, 10)]


@pytest.mark.parametrize("workers", [1, 4])
def test_blocks_come_in_order_and_each_sample_is_read_once(workers: int) -> None:
    numbers = Numbers(10)
    found = [[sample.number for sample in block] for block in read_ahead(numbers, BLOCKS, workers=workers)]
    assert found == [[0, 1, 2], [6, 7, 8], [9]]
    assert numbers.reads == [1, 1, 1, 0, 0, 0, 1, 1, 1, 1]


def test_items_of_a_torch_dataset_know_their_numbers() -> None:
    items = TorchDataset(Numbers(10))  # type: ignore[arg-type]
    (first, *_) = read_ahead(items, BLOCKS[1:], workers=2)
    assert [item.index for item in first] == [item.sample.number for item in first] == [6, 7, 8]
    assert first[0].views["left"].shape == (3, 32, 32) and int(first[0].views["left"][0, 0, 0]) == 6


def test_what_waits_is_bounded() -> None:
    numbers = Numbers(100)
    with contextlib.closing(read_ahead(numbers, [range(i, i + 2) for i in range(0, 100, 2)], workers=3)) as reading:
        next(reading)
        for _ in range(100):
            time.sleep(0.01)
            if sum(numbers.reads) >= 2 + 3:
                break
        time.sleep(0.05)
        assert sum(numbers.reads) <= 2 * 2 + 3, "the next block, or one sample a thread"


def test_an_unreadable_sample_raises_in_its_order_and_threads_end() -> None:
    before = threading.active_count()
    reading = read_ahead(Numbers(10, broken=7), BLOCKS, workers=2)
    assert [sample.number for sample in next(reading)] == [0, 1, 2]
    with pytest.raises(OSError, match="sample 7 is broken"):
        next(reading)
    assert threading.active_count() == before


def test_closing_ends_its_threads() -> None:
    before = threading.active_count()
    with contextlib.closing(read_ahead(Numbers(10), BLOCKS, workers=2)) as reading:
        next(reading)
        assert threading.active_count() > before
    assert threading.active_count() == before


def test_what_fits_is_decoded_once() -> None:
    numbers, tight = Numbers(6), Numbers(6)
    for kept in (Kept(numbers, 1e9), Kept(tight, 3 * 32 * 32 * 3)):  # type: ignore[arg-type]
        for _ in range(3):
            assert [kept[i].number for i in range(6)] == list(range(6))
        assert kept[-1].number == 5 and [sample.number for sample in kept[1:3]] == [1, 2]
    assert numbers.reads == [1] * 6
    assert tight.reads == [1, 1, 1, 3, 3, 4]
