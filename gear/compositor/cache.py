"""A least-recently-used cache with a limit in bytes."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class Sized(Protocol):
    """An object that reports its memory."""

    @property
    def nbytes(self) -> int:
        """Memory in bytes."""
        ...


ThingT = TypeVar("ThingT", bound=Sized)


class Cache(Generic[ThingT]):
    """Objects by key; the least recently used one is dropped first. Not safe for several threads."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._things: OrderedDict[Hashable, ThingT] = OrderedDict()
        self.nbytes = 0

    def __len__(self) -> int:
        return len(self._things)

    def get(self, key: Hashable, make: Callable[[], ThingT]) -> ThingT:
        """The object with a key; `make` creates it if it is missing. An object larger than the cache is not stored."""
        if key in self._things:
            self._things.move_to_end(key)
            return self._things[key]
        thing = make()
        self._things[key] = thing
        self.nbytes += thing.nbytes
        while self.nbytes > self._max_bytes and self._things:
            self.nbytes -= self._things.popitem(last=False)[1].nbytes
        return thing
