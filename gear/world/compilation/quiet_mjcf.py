"""Imports `dm_control.mjcf` without the warnings of a window toolkit that finds no display."""

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
        # dm-control depends on labmaze, which gear does not use and which pip cannot build from Python 3.13 on.
        raise GearError(
            "towns are composed with dm-control, which is not installed: pip install --no-deps dm-control"
        ) from error

__all__ = ["mjcf"]
