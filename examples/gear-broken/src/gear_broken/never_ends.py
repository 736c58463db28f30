"""Offers an endless number of specs."""

from collections.abc import Iterator
from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_defenses() -> Iterator[Any]:
    """Yields one object after another and never ends."""
    while True:
        yield None
