"""Sequences whose items are read or computed when they are accessed."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, Generic, TypeVar, overload

ItemT_co = TypeVar("ItemT_co", covariant=True)


class LazySequence(Sequence[ItemT_co], Generic[ItemT_co]):
    """A sequence that reads or computes each item on access and keeps none. A slice is a list of its items.

    A subclass defines `__len__` and `item`.
    """

    __slots__ = ()

    @abstractmethod
    def item(self, index: int) -> ItemT_co:
        """Reads or computes one item.

        Args:
            index: index of the item, at least 0 and less than the length.
        """

    @overload
    def __getitem__(self, index: int) -> ItemT_co: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[ItemT_co]: ...
    def __getitem__(self, index: int | slice) -> Any:
        if isinstance(index, slice):
            return [self.item(one) for one in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(f"item {index} of {len(self)}")
        return self.item(index % len(self))

    def __iter__(self) -> Iterator[ItemT_co]:
        return (self.item(index) for index in range(len(self)))
