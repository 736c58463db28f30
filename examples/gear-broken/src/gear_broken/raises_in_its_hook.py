"""Raises when it is asked what it offers."""

from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_defenses() -> list[Any]:
    """Raises an exception in place of returning specs."""
    raise KeyError("weights")
