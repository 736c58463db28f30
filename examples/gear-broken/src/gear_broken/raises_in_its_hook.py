"""Raises when it is asked what it offers."""

from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_defenses() -> list[Any]:
    """Never answers."""
    raise KeyError("weights")
