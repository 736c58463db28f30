"""One camera, one view and one scene for the tests of camera effects."""

from __future__ import annotations

import numpy as np

from gear.camera.effects import Exposure
from gear.contracts.rendering import RawView
from gear.values.frames import UInt16Image
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.scene import ActorRecord, CameraRecord, Pose, SceneRecord, Vec3, Weather

WIDTH, HEIGHT, FOCAL_PX = 160, 96, 80.0
CAMERA = CameraRecord(
    name="c", width_px=WIDTH, height_px=HEIGHT, focal_px=FOCAL_PX,
    world_from_camera=Pose.from_transform(
        RigidTransform.from_parts("world", "camera", CAMERA_FROM_ACTOR_AXES.T, (0, 0, 1.6))
    ),
)  # fmt: skip


def exposure(
    velocity_mps: Vec3 = (0.0, 0.0, 0.0), *, seed: int = 5, index: int = 0, camera: CameraRecord = CAMERA
) -> Exposure:
    """An exposure of a car that drives with a velocity in the world."""
    ego = ActorRecord(
        id=1,
        asset="car",
        role="ego",
        world_from_actor=Pose(position_m=(0.0, 0.0, 0.0)),
        velocity_world_mps=velocity_mps,
    )
    scene = SceneRecord(
        town="t", scene="s", split="test", seed=seed, index=index, sequence=index, frame=0, time_s=0.0,
        weather=Weather(name="w"), actors=(ego,), surfaces=(), cameras=(camera,),
    )  # fmt: skip
    return Exposure(camera=camera, scene=scene)


def raw(colour: UInt16Image | None = None, depth_m: np.ndarray | None = None) -> RawView:
    """A view; by default red counts columns and green rows, and depth and ids say the same."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    if colour is None:
        colour = np.stack([x * 4, y * 4, np.full_like(x, 300)], axis=-1).astype(np.uint16)
    rows, columns = colour.shape[:2]
    if depth_m is None:
        depth_m = (1 + x + 1000.0 * y).astype(np.float32) if (rows, columns) == (HEIGHT, WIDTH) else None
    if depth_m is None:
        depth_m = np.ones((rows, columns), np.float32)
    ids = (x + 1000 * y).astype(np.int32) if (rows, columns) == (HEIGHT, WIDTH) else np.zeros((rows, columns), np.int32)
    return RawView(linear_rgb=colour, depth_m=depth_m, geom_id=ids)
