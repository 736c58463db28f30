"""A cache with a limit in bytes, which drops the least recently used objects."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar


class Sized(Protocol):
    """Protocol of objects with an attribute `nbytes`, their memory in bytes."""

    @property
    def nbytes(self) -> int:
        """The memory of the object in bytes."""
        ...


ThingT = TypeVar("ThingT", bound=Sized)


class Cache(Generic[ThingT]):
    """A dictionary of objects with a limit in bytes, which drops the least recently used object first.

    It is not thread-safe.

    Attributes:
        nbytes: memory of all stored objects in bytes.
    """

    def __init__(self, max_bytes: int) -> None:
        """Makes an empty cache.

        Args:
            max_bytes: memory limit of all stored objects together, bytes.
        """
        self._max_bytes = max_bytes
        self._things: OrderedDict[Hashable, ThingT] = OrderedDict()
        self.nbytes = 0

    def __len__(self) -> int:
        return len(self._things)

    def get(self, key: Hashable, make: Callable[[], ThingT]) -> ThingT:
        """Returns the object for a key; a missing object is created by `make` and stored.

        An object that is larger than the whole cache is returned but not stored, and the cache is emptied.

        Args:
            key: key of the object.
            make: function that creates the object; it is called only if the object is not stored.
        """
        if key in self._things:
            self._things.move_to_end(key)
            return self._things[key]
        thing = make()
        self._things[key] = thing
        self.nbytes += thing.nbytes
        while self.nbytes > self._max_bytes and self._things:
            self.nbytes -= self._things.popitem(last=False)[1].nbytes
        return thing
