"""Returns what is no spec."""

from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_models() -> list[Any]:
    """Rubbish."""
    return [42, "resnet"]
