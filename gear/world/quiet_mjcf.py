"""`dm_control.mjcf`, without the complaint of a window toolkit that finds no display; gear never opens a window."""

from __future__ import annotations

import warnings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from dm_control import mjcf

__all__ = ["mjcf"]
