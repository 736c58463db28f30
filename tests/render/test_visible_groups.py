"""Only geoms of the visible groups are drawn."""

from __future__ import annotations

import mujoco

from gear.render.visible_groups import geoms_only


def test_collision_geoms_and_helpers_make_no_visual_geoms() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body><joint type="hinge"/><site size="1"/><geom name="shown" size="1" group="2"/>
        <geom name="collision" size="1" group="3"/></body></worldbody></mujoco>"""
    )
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, maxgeom=100)
    mujoco.mj_forward(model, data)
    camera, every = mujoco.MjvCamera(), mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, geoms_only(), None, camera, every, scene)
    shown = [(g.objtype, g.objid) for g in scene.geoms[: scene.ngeom]]
    assert shown == [(mujoco.mjtObj.mjOBJ_GEOM, model.geom("shown").id)]
