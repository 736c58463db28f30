"""Tests whether a renderer works on this machine, by rendering a small reference frame."""

from __future__ import annotations

import hashlib
import math
import time
from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from gear.contracts.rendering import Quality, RawView, RendererInfo, Stage
from gear.render.native_output import native_output
from gear.render.registry import open_renderer
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Intrinsics, RigidTransform
from gear.values.scene import CameraRecord, Pose

_REFERENCE_MJCF = """
<mujoco model="reference">
  <custom><numeric name="filament.ao.enabled" data="0"/></custom>
  <asset>
    <texture name="grid" type="2d" builtin="checker" width="64" height="32" rgb1="0.8 0.2 0.1" rgb2="0.1 0.3 0.7"
             colorspace="sRGB"/>
    <material name="grid" texture="grid"/>
    <mesh name="board" vertex="0 1 0.5  0 -1 0.5  0 -1 -0.5  0 1 -0.5" texcoord="0 0  1 0  1 1  0 1" face="0 3 2  0 2 1"
          inertia="shell"/>
  </asset>
  <worldbody>
    <light type="directional" dir="0.5 0.3 -0.8" diffuse="0.7 0.7 0.7" ambient="0.2 0.2 0.2"/>
    <geom type="plane" size="40 40 1" rgba="0.3 0.3 0.3 1"/>
    <geom type="box" size="0.6 0.4 0.5" pos="5 1.6 0.5" rgba="0.1 0.5 0.2 1"/>
    <geom type="sphere" size="0.4" pos="4 -0.8 0.4" rgba="0.6 0.5 0.1 1"/>
    <geom type="mesh" mesh="board" material="grid" pos="7 -1 1.4" contype="0" conaffinity="0"/>
  </worldbody>
</mujoco>
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProbeResult:
    """The result of rendering the reference frame.

    Attributes:
        info: name, driver and device of the renderer.
        sha256: hash of the linear picture, the depth and the ids, little-endian, in this order.
        start_s: time to start the renderer, seconds.
        frame_s: time for the second frame, seconds; the first one also compiles shaders.
    """

    info: RendererInfo
    sha256: str
    start_s: float
    frame_s: float


def probe(name: str, *, quality: Quality = "film") -> ProbeResult:
    """Tests a renderer: starts it, renders the reference frame twice, and measures the times.

    Args:
        name: name of the renderer: `raster`, `filament` or `classic`.
        quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.

    Raises:
        UnknownNameError: there is no renderer with this name.
        BackendError: the renderer cannot start on this machine; the message says what to install.
    """
    model = mujoco.MjModel.from_xml_string(_REFERENCE_MJCF)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    stage = Stage(model=model, data=data)
    with native_output():  # on a busy machine the driver's thread writes messages after frames are done
        started = time.perf_counter()
        renderer = open_renderer(name, model, quality=quality)
        try:
            start_s = time.perf_counter() - started
            renderer.render(stage, (_CAMERA,))
            started = time.perf_counter()
            (view,) = renderer.render(stage, (_CAMERA,))
            frame_s = time.perf_counter() - started
            return ProbeResult(info=renderer.info, sha256=_sha256(view), start_s=start_s, frame_s=frame_s)
        finally:
            renderer.close()


def _sha256(view: RawView) -> str:
    digest = hashlib.sha256()
    for array, dtype in ((view.linear_rgb, "<u2"), (view.depth_m, "<f4"), (view.geom_id, "<i4")):
        digest.update(np.ascontiguousarray(array, dtype=dtype).tobytes())
    return digest.hexdigest()


_INTRINSICS = Intrinsics.from_hfov(320, 160, math.radians(70))
_CAMERA = CameraRecord(
    name="reference",
    width_px=_INTRINSICS.width_px,
    height_px=_INTRINSICS.height_px,
    focal_px=_INTRINSICS.focal_px,
    world_from_camera=Pose.from_transform(
        RigidTransform.from_parts("world", "camera", CAMERA_FROM_ACTOR_AXES.T, (0.0, 0.1, 1.2))
    ),
)


@cache
def renderer_info(name: str) -> RendererInfo:
    """Name, driver and device of a renderer, without rendering a frame. The renderer is started to find them, so
    the result is cached.

    Args:
        name: name of the renderer: `raster`, `filament` or `classic`.

    Raises:
        UnknownNameError: there is no renderer with this name.
        BackendError: the renderer cannot start on this machine; the message says what to install.
    """
    renderer = open_renderer(name, mujoco.MjModel.from_xml_string(_REFERENCE_MJCF))
    try:
        return renderer.info
    finally:
        renderer.close()
