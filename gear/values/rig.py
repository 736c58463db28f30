"""Sensor rigs: named cameras on the ego car."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.values.errors import FieldError
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Intrinsics, RigidTransform
from gear.values.scene import CameraRecord, Pose, Vec3


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraMount:
    """One camera on the car, looking ahead.

    Attributes:
        name: key of its view: `left`, `right`, ….
        width_px, height_px: picture size.
        hfov_deg: horizontal field of view.
        position_m: in the ego frame, x forward, y left, z up.
        yaw_deg, pitch_deg, roll_deg: turned to the left, downwards, to the right; 0 is straight ahead and level.
    """

    name: str
    width_px: int
    height_px: int
    hfov_deg: float = 90.0
    position_m: Vec3 = (1.5, 0.0, 1.65)
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0

    def __post_init__(self) -> None:
        if not (16 <= self.width_px <= 8192 and 16 <= self.height_px <= 8192):
            raise FieldError("width_px", f"pictures are 16 to 8192 px a side, got {self.width_px} x {self.height_px}")
        if not 1 <= self.hfov_deg <= 170:
            raise FieldError("hfov_deg", f"must be 1 to 170 degrees, got {self.hfov_deg}")

    @property
    def intrinsics(self) -> Intrinsics:
        """The pinhole."""
        return Intrinsics.from_hfov(self.width_px, self.height_px, math.radians(self.hfov_deg))

    @property
    def ego_from_camera(self) -> RigidTransform:
        """Pose on the car: yaw, then pitch, then roll, in the car's axes."""
        cy, sy = math.cos(math.radians(self.yaw_deg)), math.sin(math.radians(self.yaw_deg))
        cp, sp = math.cos(math.radians(self.pitch_deg)), math.sin(math.radians(self.pitch_deg))
        cr, sr = math.cos(math.radians(self.roll_deg)), math.sin(math.radians(self.roll_deg))
        yaw = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        pitch = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        roll = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        rotation = yaw @ pitch @ roll @ CAMERA_FROM_ACTOR_AXES.T
        return RigidTransform.from_parts("ego", "camera", rotation, self.position_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """The cameras of a task.

    Attributes:
        cameras: the first one is the reference: the board must be in its view.
        follows_road: False keeps the rig level (yaw only), as the CARLA-GeAR loaders demand; True takes the car's
            pitch and roll.
    """

    cameras: tuple[CameraMount, ...]
    follows_road: bool = False

    def __post_init__(self) -> None:
        names = [camera.name for camera in self.cameras]
        if not names:
            raise FieldError("cameras", "a rig needs at least one camera")
        if len(set(names)) != len(names):
            raise FieldError("cameras", f"two cameras share a name: {', '.join(names)}")

    def place(self, world_from_ego: RigidTransform) -> tuple[CameraRecord, ...]:
        """The cameras of a car that stands at `world_from_ego`."""
        base = world_from_ego
        if not self.follows_road:
            base = RigidTransform.from_yaw("world", "ego", world_from_ego.translation_m, world_from_ego.yaw_rad)
        return tuple(
            CameraRecord(
                name=mount.name,
                width_px=mount.width_px,
                height_px=mount.height_px,
                focal_px=mount.intrinsics.focal_px,
                world_from_camera=Pose.from_transform(base @ mount.ego_from_camera),
            )
            for mount in self.cameras
        )
