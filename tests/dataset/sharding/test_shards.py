"""Shards of a split: every sequence is in exactly one."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset.sharding.shards import WHOLE, Picked, Shard
from gear.dataset.store import Store
from gear.values.errors import GearError
from tests.dataset.splits import plan


@pytest.mark.parametrize(
    "text", ["", "1", "0/2", "3/2", "1/0", "-1/2", "1/2/3", "a/b", "1.0/2", "1/ 2", "١/٢", "1/" + "9" * 40]
)
def test_what_is_no_shard_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(GearError, match=r"must be I/N with I from 1 to N, such as 2/8"):
        Shard.parse(text)


def test_a_shard_is_written_as_it_is_read() -> None:
    assert str(Shard.parse("2/8")) == "2/8"
    assert Shard.parse("1/1") == WHOLE


@pytest.mark.parametrize("count", [1, 2, 7, 30])
def test_every_sequence_is_whole_and_in_one_shard(count: int, tmp_path: Path) -> None:
    store = Store(tmp_path, plan(samples=24, content={"frames": 3}))
    parts = [store.indices(Shard(number=number + 1, count=count)) for number in range(count)]
    assert sorted(index for part in parts for index in part) == list(range(24))
    assert all(part == sorted(part) for part in parts)
    for part in parts:
        assert {index // 3 * 3 + frame for index in part for frame in range(3)} == set(part)
    assert max(map(len, parts)) - min(map(len, parts)) <= 3


def test_a_longer_split_keeps_the_samples_of_its_shards(tmp_path: Path) -> None:
    second = Shard(number=2, count=3)
    short = Store(tmp_path, plan(samples=10)).indices(second)
    assert Store(tmp_path, plan(samples=20)).indices(second)[: len(short)] == short


def test_a_picked_part_holds_what_was_picked() -> None:
    part = Picked(sequences=frozenset({1, 4}))
    assert [number for number in range(6) if part.holds(number)] == [1, 4]
