"""What of a model may be seen."""

from __future__ import annotations

import mujoco


def geoms_only() -> mujoco.MjvOption:
    """Geoms of groups 0 to 2; no collision geoms, sites, skins or helpers."""
    option = mujoco.MjvOption()
    mujoco.mjv_defaultOption(option)
    option.geomgroup[:] = (1, 1, 1, 0, 0, 0)
    helpers = (option.sitegroup, option.jointgroup, option.tendongroup, option.actuatorgroup, option.flexgroup)
    for groups in (*helpers, option.skingroup):
        groups[:] = 0
    return option
