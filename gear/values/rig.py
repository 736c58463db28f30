"""Camera rigs: the named cameras on the ego car, with their intrinsics and mounting poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.values.errors import FieldError
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Intrinsics, RigidTransform
from gear.values.scene import CameraRecord, Pose, Vec3

LEAST_FOCAL, MOST_FOCAL = 0.043, 58.0
"""Smallest and largest focal length, as multiples of the picture's width (fx) or height (fy): those of fields of
view of 170 degrees and 1 degree.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraMount:
    """One camera of the ego car, with its intrinsics and its mounting pose.

    Attributes:
        name: key of the camera's view: `left`, `right`, ….
        width_px, height_px: size of the picture.
        hfov_deg: horizontal field of view, 1 to 170 degrees; not used if `focal_px` is given.
        focal_px: horizontal focal length fx; None for the focal length that follows from `hfov_deg`.
        focal_y_px: vertical focal length fy; None for the same as the horizontal one.
        principal_px: principal point (cx, cy) in index pixels; None for the middle of the picture.
        position_m: position in the ego frame: x forward, y left, z up, the origin on the ground.
        yaw_deg, pitch_deg, roll_deg: rotation to the left, downwards, and clockwise as seen from behind the camera; 0
            is straight ahead and level.
    """

    name: str
    width_px: int
    height_px: int
    hfov_deg: float = 90.0
    focal_px: float | None = None
    focal_y_px: float | None = None
    principal_px: tuple[float, float] | None = None
    position_m: Vec3 = (1.5, 0.0, 1.65)
    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0

    def __post_init__(self) -> None:
        if not (16 <= self.width_px <= 8192 and 16 <= self.height_px <= 8192):
            raise FieldError("width_px", f"pictures are 16 to 8192 px a side, got {self.width_px} x {self.height_px}")
        if not 1 <= self.hfov_deg <= 170:
            raise FieldError("hfov_deg", f"must be 1 to 170 degrees, got {self.hfov_deg}")
        for name, size_px in (("focal_px", self.width_px), ("focal_y_px", self.height_px)):
            focal_px, low, high = getattr(self, name), size_px * LEAST_FOCAL, size_px * MOST_FOCAL
            if focal_px is not None and not low <= focal_px <= high:
                raise FieldError(name, f"must be {low:.4g} to {high:.4g} px for {size_px} px, got {focal_px:g}")
        if self.principal_px is not None:
            u, v = self.principal_px
            if not (-0.5 <= u <= self.width_px - 0.5 and -0.5 <= v <= self.height_px - 0.5):
                raise FieldError("principal_px", f"must lie in the picture, got [{u:g}, {v:g}]")
        for name, most in (("yaw_deg", 180), ("pitch_deg", 90), ("roll_deg", 180)):
            if not -most <= getattr(self, name) <= most:
                raise FieldError(name, f"must be -{most} to {most} degrees, got {getattr(self, name):g}")

    @property
    def intrinsics(self) -> Intrinsics:
        """The intrinsics of the pinhole camera in index pixels: the centre of the first pixel is (0, 0)."""
        focal_px = self.focal_px
        if focal_px is None:
            focal_px = Intrinsics.from_hfov(self.width_px, self.height_px, math.radians(self.hfov_deg)).focal_px
        return Intrinsics(self.width_px, self.height_px, focal_px, self.focal_y_px, self.principal_px)

    @property
    def ego_from_camera(self) -> RigidTransform:
        """The camera's pose in the ego car's frame: rotated by yaw, then pitch, then roll."""
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
    """The cameras of a task, mounted on the ego car.

    Attributes:
        cameras: the cameras; the first one is the reference camera, which must have the boards in view.
        follows_road: False keeps the rig level (yaw only), as the loaders of CARLA-GeAR require; True rotates the rig
            with the car's pitch and roll.
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
        """The records of all cameras, with their poses in the world, for a pose of the ego car.

        Args:
            world_from_ego: pose of the ego car. If `follows_road` is False, only its position and yaw are used.

        Returns:
            One record per camera, in the order of `cameras`.
        """
        base = world_from_ego
        if not self.follows_road:
            base = RigidTransform.from_yaw("world", "ego", world_from_ego.translation_m, world_from_ego.yaw_rad)
        return tuple(
            CameraRecord(
                name=mount.name,
                width_px=mount.width_px,
                height_px=mount.height_px,
                focal_px=mount.intrinsics.focal_px,
                focal_y_px=mount.focal_y_px,
                principal_px=mount.principal_px,
                world_from_camera=Pose.from_transform(base @ mount.ego_from_camera),
            )
            for mount in self.cameras
        )
