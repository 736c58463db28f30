"""Checks the environment variable `MUJOCO_GL` before MuJoCo and dm_control read it at their import."""

from __future__ import annotations

import os
import sys

from gear.values.errors import GearError

BACKENDS = ("egl", "osmesa")
"""Values of `MUJOCO_GL` that gear follows: the ways to OpenGL without a window."""

IGNORED = ("", "glfw", "on", "enable", "enabled", "true", "1", "off", "disable", "disabled", "false", "0")
"""Values of `MUJOCO_GL` that MuJoCo and dm_control accept but that select no rendering without a window; gear
ignores them.
"""


def check_mujoco_gl() -> None:
    """Refuses a value of `MUJOCO_GL` that gear can neither follow nor ignore.

    An accepted value is written into the environment in lower case, because dm_control accepts no other spelling. If
    MuJoCo is already imported, nothing is checked.

    Raises:
        GearError: the value is neither one of `BACKENDS` nor one of `IGNORED`.
    """
    given = os.environ.get("MUJOCO_GL")
    if given is None or "mujoco" in sys.modules:
        return
    value = given.strip().lower()
    if value not in BACKENDS + IGNORED:
        raise GearError(
            f"MUJOCO_GL is {given[:40]!r}, and gear renders without a window, through EGL or OSMesa;"
            " unset MUJOCO_GL, or set it to egl or osmesa"
        )
    if value != given:
        os.environ["MUJOCO_GL"] = value
