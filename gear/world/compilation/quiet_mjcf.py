"""Imports `dm_control.mjcf` at its first use, without the warnings of a window toolkit that finds no display.

The import takes 0.2 s, and a world that is loaded from the cache does not need it.
"""

from __future__ import annotations

import importlib.util
import warnings
from typing import TYPE_CHECKING, Any

from gear.values.errors import GearError

if TYPE_CHECKING:
    from dm_control import mjcf

__all__ = ["mjcf"]

if importlib.util.find_spec("dm_control") is None:
    # dm-control depends on labmaze, which gear does not use and which pip cannot build from Python 3.13 on.
    raise GearError("towns are composed with dm-control, which is not installed: pip install --no-deps dm-control")


def __getattr__(name: str) -> Any:
    """The module `dm_control.mjcf` for the name `mjcf`.

    Raises:
        AttributeError: another name was asked for.
    """
    if name != "mjcf":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from dm_control import mjcf
    return mjcf
