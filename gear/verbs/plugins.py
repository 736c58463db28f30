"""`gear.list_plugins`: the installed plugins, as `gear plugins` lists them."""

from __future__ import annotations

from gear.contracts.specs import KINDS, Kind
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import catalogue
from gear.values.errors import UnknownNameError


def list_plugins(kind: Kind | None = None) -> tuple[PluginEntry, ...]:
    """Lists the working plugins with their specs and the packages that bring them.

    Args:
        kind: `task`, `model`, `attack`, `defense`, `controller`, `metric` or `logger`; all kinds by default.

    Raises:
        UnknownNameError: there is no such kind.
    """
    if kind is not None and kind not in KINDS:
        raise UnknownNameError("kind of plugin", kind, list(KINDS))
    found = catalogue()
    return tuple(plugin for each in ((kind,) if kind else KINDS) for plugin in found.of_kind(each))
