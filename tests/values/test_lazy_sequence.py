"""Lazy sequences are sequences like lists, and read each item only when it is accessed."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from gear.values.lazy_sequence import LazySequence


class Squares(LazySequence[int]):
    def __init__(self, length: int) -> None:
        self.length, self.read = length, list[int]()

    def __len__(self) -> int:
        return self.length

    def item(self, index: int) -> int:
        self.read.append(index)
        return index * index


def test_items_are_read_on_access_by_their_index_from_the_start() -> None:
    squares = Squares(5)
    assert isinstance(squares, Sequence) and squares.read == []
    assert (squares[4], squares[-1], squares[-5]) == (16, 16, 0) and squares.read == [4, 4, 0]
    assert next(iter(squares)) == 0 and squares.read == [4, 4, 0, 0]


@pytest.mark.parametrize("places", [slice(None), slice(1, 3), slice(None, None, -2), slice(-2, 9), slice(7, 9)])
def test_slices_are_those_of_a_list(places: slice) -> None:
    squares, expected = Squares(5), [0, 1, 4, 9, 16]
    assert squares[places] == expected[places]
    assert list(squares) == expected and list(reversed(squares)) == expected[::-1] and 9 in squares


@pytest.mark.parametrize("index", [5, -6])
def test_an_index_outside_is_an_error(index: int) -> None:
    squares = Squares(5)
    with pytest.raises(IndexError, match=f"item {index} of 5"):
        squares[index]
    assert not squares.read
