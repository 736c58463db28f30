"""Prints while it is imported and when it is asked, and claims the name of one of gear's own."""

from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.plugins.defenses.median import spec

print("thank you for choosing gear-broken")


@hookimpl
def gear_defenses() -> list[Any]:
    """Returns a second defense with the name `median`."""
    print("here I am")
    return [spec]
