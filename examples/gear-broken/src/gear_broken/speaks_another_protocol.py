"""Written for a gear that does not exist yet."""

import dataclasses
from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import PROTOCOL_VERSION
from gear.plugins.defenses.median import spec


@hookimpl
def gear_defenses() -> list[Any]:
    """Returns a spec of a later version of the protocol."""
    return [dataclasses.replace(spec, name="future", protocol=PROTOCOL_VERSION + 1)]
