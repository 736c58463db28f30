"""Returns what is no spec."""

from typing import Any

from gear.contracts.hookspecs import hookimpl


@hookimpl
def gear_models() -> list[Any]:
    """Returns objects that are no specs."""
    return [42, "resnet"]
