"""`dm_control.mjcf`, without the complaint of a window toolkit that finds no display; gear never opens a window."""

from __future__ import annotations

import warnings

from gear.values.errors import GearError

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    try:
        from dm_control import mjcf
    except ModuleNotFoundError as error:
        if error.name != "dm_control":
            raise
        # From Python 3.13 on pip cannot build labmaze, on which dm-control depends and of which gear uses nothing.
        raise GearError(
            "towns are composed with dm-control, which is not installed: pip install --no-deps dm-control"
        ) from error

__all__ = ["mjcf"]
