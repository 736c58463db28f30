"""Offers an endless number of specs."""

from collections.abc import Iterator
from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_defenses() -> Iterator[Any]:
    """Yields for ever."""
    while True:
        yield None
