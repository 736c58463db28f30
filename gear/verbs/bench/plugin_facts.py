"""Facts about plugins for records, without folders of this machine."""

from __future__ import annotations

from pathlib import Path

from gear.leaderboard.package_facts import code_sha256, wheel_sha256
from gear.leaderboard.record import Plugin
from gear.measuring.plugin_selection import Chosen
from gear.values.serial import Json

UNKNOWN_VERSION = "?"
"""The version of a plugin whose package is not installed, such as one that a script made."""


def plugin_facts(chosen: Chosen, weights_sha256: str | None = None) -> Plugin:
    """Name, package, version, options and hashes of a plugin, for a record.

    Args:
        chosen: the plugin with its options.
        weights_sha256: SHA-256 of the network's weights; None for plugins without weights.

    Raises:
        FieldError: an option cannot be part of a record.
    """
    facts = chosen.facts()
    return Plugin(
        name=facts["name"],
        package=facts["package"],
        version=facts["version"].replace(UNKNOWN_VERSION, "unknown"),
        options=without_folders(facts["options"]),
        code_sha256=code_sha256(chosen.found.spec.build.__module__),
        wheel_sha256=wheel_sha256(facts["package"]),
        weights_sha256=weights_sha256,
    )


def without_folders(value: Json, key: str = "") -> Json:
    """Returns a JSON value in which paths keep only their last part; names of plugins may contain a slash.

    Args:
        value: the value.
        key: key of the value in the object that contains it.
    """
    if isinstance(value, dict):
        return {name: without_folders(inner, name) for name, inner in value.items()}
    if isinstance(value, list):
        return [without_folders(inner) for inner in value]
    is_path = isinstance(value, str) and "/" in value and key != "plugin"
    return Path(value).name if is_path else value
