"""Which sides of a box show a patch upright: what gear says, held against what renderers show."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Stage
from gear.render.registry import open_renderer
from gear.values.geometry import RigidTransform
from gear.values.scene import CameraRecord, Pose
from gear.world.surfaces.upright import texture_problem

TOP, LOW = slice(6, 14), slice(18, 26)
BOX = """
<mujoco>
  <asset>
    <texture name="face" type="2d" builtin="flat" rgb1="1 1 1" width="64" height="64" colorspace="sRGB"/>
    <material name="face" texture="face" metallic="0" roughness="0.9"/>
  </asset>
  <worldbody>
    <light type="directional" dir="-1 0 0" diffuse="1 1 1"/>
    <geom name="face" type="box" size="{size}" quat="{quat}" material="face"/>
    <site name="surface" xyaxes="0 1 0 0 0 -1"/>
  </worldbody>
</mujoco>
"""


def orientations() -> list[tuple[int, tuple[float, ...]]]:
    """Every way in which a box can stand square: which of its axes lies along the world's x, and how it is turned."""
    found = []
    axes = [s * np.eye(3)[i] for i in range(3) for s in (1, -1)]
    for x in axes:
        for y in axes:
            if abs(x @ y) < 0.5:
                rotation = np.stack([x, y, np.cross(x, y)], axis=1)
                axis = int(np.abs(rotation[0]).argmax())
                quat = np.empty(4)
                mujoco.mju_mat2Quat(quat, rotation.reshape(-1))
                found.append((axis, tuple(quat.round(9))))
    return found


@pytest.mark.parametrize("name", ["classic", "filament", "raster"])
def test_a_box_is_taken_where_it_shows_its_patch_upright(name: str) -> None:
    camera = CameraRecord(
        name="rgb",
        width_px=32,
        height_px=32,
        focal_px=48.0,
        world_from_camera=Pose.from_transform(
            RigidTransform.from_parts("world", "camera", [[0, 0, -1], [1, 0, 0], [0, -1, 0]], (3.0, 0, 0))
        ),
    )
    patch = np.zeros((64, 64, 3), np.uint8)
    patch[:32, :32], patch[:32, 32:] = 255, 160
    taken = 0
    for axis, quat in orientations():
        size = np.full(3, 1.0)
        size[axis] = 0.002
        model = mujoco.MjModel.from_xml_string(BOX.format(size=" ".join(map(str, size)), quat=" ".join(map(str, quat))))
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer = open_renderer(name, model, quality="fast")
        try:
            (view,) = renderer.render(Stage(model=model, data=data, paint_rgb={}, faces={0: patch}), (camera,))
        finally:
            renderer.close()
        assert view.linear_rgb is not None
        light = view.linear_rgb.sum(axis=-1).astype(float)
        white, grey, *black = (light[rows, columns].mean() for rows in (TOP, LOW) for columns in (TOP, LOW))
        is_upright = white > 1.2 * grey and grey > 2 * max(black)
        frames = [
            RigidTransform.from_parts("world", frame, matrix.reshape(3, 3), (0, 0, 0))
            for frame, matrix in (("surface", data.site_xmat[0]), ("geom", data.geom_xmat[0]))
        ]
        wrong = texture_problem(model, 0, frames[0].inverse() @ frames[1])
        assert is_upright == (not wrong), (axis, quat)
        taken += is_upright
    assert taken == 3, "one side of each pair, turned one way"
