"""One small asymmetric street, and both renderers open on it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Renderer, Stage
from gear.render import RENDERERS, open_renderer
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Intrinsics, RigidTransform
from gear.values.scene import CameraRecord, Pose

STREET = """
<mujoco>
  <custom>
    <text name="filament.material.base_color_type" data="linear"/>
    <numeric name="filament.ao.enabled" data="0"/>
  </custom>
  <visual><headlight ambient="0.4 0.4 0.4"/></visual>
  <asset>
    <texture name="face" type="2d" builtin="flat" rgb1="0.5 0.5 0.5" width="64" height="32" colorspace="sRGB"/>
    <material name="face" texture="face" metallic="0" roughness="0.9"/>
    <material name="red" rgba="0.5 0.02 0.02 1"/>
    <mesh name="face" vertex="0 2 1  0 -2 1  0 -2 -1  0 2 -1" texcoord="0 0  1 0  1 1  0 1" face="0 3 2  0 2 1"
          inertia="shell"/>
  </asset>
  <worldbody>
    <light name="sun" type="directional" dir="0.6 0.3 -0.7" diffuse="0.6 0.6 0.6" intensity="60000"/>
    <geom name="road" type="box" size="60 8 0.1" pos="50 0 -0.1" rgba="0.1 0.1 0.1 1"/>
    <geom name="wall" type="box" size="30 0.5 4" pos="40 9 4" rgba="0.4 0.35 0.3 1"/>
    <geom name="kiosk" type="box" size="0.7 0.5 1.1" pos="9 -3 1.1" rgba="0.1 0.3 0.6 1"/>
    <geom name="post" type="box" size="0.1 0.1 2" pos="6 2.5 2" rgba="0.6 0.6 0.1 1"/>
    <geom name="face" type="mesh" mesh="face" material="face" pos="14 1 2.2" contype="0" conaffinity="0"/>
    <body name="car" mocap="true" pos="11 -0.5 0.7" quat="0.966 0 0 0.259">
      <geom name="car" type="box" size="1.2 0.6 0.6" material="red"/>
    </body>
    <geom name="felt" type="box" size="0.5 0.5 0.5" pos="5 -1 0.5" group="3"/>
    <site name="mark" type="box" size="0.5 0.5 0.5" pos="5 1 0.5"/>
  </worldbody>
</mujoco>
"""


def camera(
    width_px: int = 160, height_px: int = 96, *, x_m: float = 0.0, y_m: float = 0.3, yaw_deg: float = 4.0
) -> CameraRecord:
    """At the height of a car's roof, a little askew, so that no two directions are alike."""
    intrinsics = Intrinsics.from_hfov(width_px, height_px, math.radians(80))
    world_from_ego = RigidTransform.from_yaw("world", "ego", (x_m, y_m, 0), math.radians(yaw_deg))
    ego_from_camera = RigidTransform.from_parts("ego", "camera", CAMERA_FROM_ACTOR_AXES.T, (0, 0, 1.6))
    return CameraRecord(
        name="front",
        width_px=width_px,
        height_px=height_px,
        focal_px=intrinsics.focal_px,
        world_from_camera=Pose.from_transform(world_from_ego @ ego_from_camera),
    )


def posed(model: mujoco.MjModel) -> mujoco.MjData:
    """Data with everything in its place."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def grey_face(value: int) -> np.ndarray:
    """A face of one sRGB byte."""
    return np.full((32, 64, 3), value, np.uint8)


@pytest.fixture(scope="session")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(STREET)


@pytest.fixture
def stage(model: mujoco.MjModel) -> Stage:
    return Stage(model=model, data=posed(model))


@pytest.fixture(scope="session", params=[(name, quality) for name in RENDERERS for quality in ("film", "fast")])
def renderer(request: pytest.FixtureRequest, model: mujoco.MjModel) -> Iterator[Renderer]:
    """Each renderer in each quality, open for the whole session: what one test leaves behind, the next would see."""
    name, quality = request.param
    opened = open_renderer(name, model, quality=quality)
    yield opened
    opened.close()


def geom(model: mujoco.MjModel, name: str) -> int:
    """Id by name."""
    return int(model.geom(name).id)
