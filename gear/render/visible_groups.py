"""The geom groups that MuJoCo's renderers draw."""

from __future__ import annotations

import mujoco


def geoms_only() -> mujoco.MjvOption:
    """MuJoCo visualisation options that show geoms of groups 0 to 2, and no collision geoms, sites, skins or other
    helpers.
    """
    option = mujoco.MjvOption()
    mujoco.mjv_defaultOption(option)
    option.geomgroup[:] = (1, 1, 1, 0, 0, 0)
    helpers = (option.sitegroup, option.jointgroup, option.tendongroup, option.actuatorgroup, option.flexgroup)
    for groups in (*helpers, option.skingroup):
        groups[:] = 0
    return option
