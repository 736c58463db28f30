"""`MUJOCO_GL`, which MuJoCo and dm_control read when they are imported, checked before they are."""

from __future__ import annotations

import os
import sys

from gear.values.errors import GearError

BACKENDS = ("egl", "osmesa")
"""Ways to OpenGL without a window: the values that gear follows."""

IGNORED = ("", "glfw", "on", "enable", "enabled", "true", "1", "off", "disable", "disabled", "false", "0")
"""Values that both libraries accept and that say nothing about rendering without a window."""


def check_mujoco_gl() -> None:
    """Refuses a value of `MUJOCO_GL` with which MuJoCo or dm_control cannot be imported, or that needs a window.

    The value is written in lower case into the environment, since dm_control takes no other. Once MuJoCo is imported
    nothing is checked any more.

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
