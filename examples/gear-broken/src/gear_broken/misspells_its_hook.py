"""The hook is called `gear_defenses`."""

from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_defences() -> list[Any]:
    """Is never called, since gear has no hook of this name."""
    return []
