"""What level wet ground mirrors: the street as a camera below the ground sees it.

A mirror shows what a camera sees that stands as far behind it as the real one before it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.noise import sampled
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import Array, RigidTransform
from gear.values.scene import CameraRecord, Pose

_Floats = npt.NDArray[np.float32]

Below = tuple[RawView, CameraRecord]
"""What a camera from `camera_below` saw."""

SHARE_PX = 0.5
"""Of the picture's pixels to a radian: water that rain stirs and rough ground show less than a mirror."""

_RAYS = (17, 65)
"""Columns and rows of rays that say what of the street the picture can mirror."""

_MARGIN_PX = 4
_BLUR_RAD = (0.008, 0.04)
"""Standard deviations across and along the view of what damp ground mirrors: leaning facets draw it out to streaks."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Reflection:
    """The street from below.

    Attributes:
        camera: who looked.
        height_m: of the mirror in the world.
        sharp: (h, w, 3) float32 light, 1.0 is the frame's full scale: as still water shows it.
        soft: the same as damp ground shows it.
    """

    camera: CameraRecord
    height_m: float
    sharp: _Floats
    soft: _Floats

    @staticmethod
    def of(view: RawView, camera: CameraRecord, height_m: float) -> Reflection:
        """From a rendered view of a world without its ground.

        Args:
            view: of `camera`.
            camera: from `camera_below`.
            height_m: of the mirror.
        """
        assert view.linear_rgb is not None
        light = view.linear_rgb.astype(np.float32) * np.float32(1 / LINEAR_FULL_SCALE)
        across, along = (rad * camera.focal_px for rad in _BLUR_RAD)
        soft = cv2.GaussianBlur(light, (0, 0), across, sigmaY=along, borderType=cv2.BORDER_REPLICATE)
        return Reflection(camera=camera, height_m=height_m, sharp=light, soft=np.asarray(soft, dtype=np.float32))

    def at(self, picture: _Floats, east: _Floats, north: _Floats, up: _Floats) -> _Floats:
        """(N, 3) of `sharp` or `soft` in (N,) directions, of any length."""
        x, y, z = (
            axis[0] * east + axis[1] * north + axis[2] * up
            for axis in self.camera.world_from_camera_transform.rotation.T.astype(np.float32)
        )
        z = np.maximum(z, np.float32(1e-6))
        column = x / z * np.float32(self.camera.focal_px) + np.float32((self.camera.width_px - 1) / 2)
        row = y / z * np.float32(self.camera.focal_px) + np.float32((self.camera.height_px - 1) / 2)
        return sampled(picture, column, row, is_periodic=False)


def camera_below(camera: CameraRecord, height_m: float) -> CameraRecord | None:
    """Who sees what a level mirror shows to a camera; None where the camera looks at no ground.

    Args:
        camera: above the mirror.
        height_m: of the mirror in the world.
    """
    world_from_camera = camera.world_from_camera_transform
    columns, rows = np.meshgrid(
        np.linspace(-0.5, 0.5, _RAYS[0]) * camera.width_px, np.linspace(-0.5, 0.5, _RAYS[1]) * camera.height_px
    )
    rays = np.stack([columns.ravel(), rows.ravel(), np.full(columns.size, camera.focal_px)])
    rays = (world_from_camera.rotation @ (rays / np.linalg.norm(rays, axis=0))).T
    mirrored = rays[rays[:, 2] < 0] * (1, 1, -1)
    if not len(mirrored) or world_from_camera.translation_m[2] <= height_m:
        return None
    rotation = _facing(mirrored.mean(axis=0), world_from_camera.rotation[:, 0])
    seen = mirrored @ rotation
    reach = np.abs(seen[:, :2] / np.maximum(seen[:, 2:], 0.05)).max(axis=0)
    focal_px = SHARE_PX * camera.focal_px
    width_px, height_px = (2 * int(np.ceil(side * focal_px) + _MARGIN_PX) for side in reach)
    position_m = world_from_camera.translation_m * (1, 1, -1) + (0, 0, 2 * height_m)
    pose = RigidTransform.from_parts("world", "camera", rotation, position_m)
    return replace(
        camera, width_px=width_px, height_px=height_px, focal_px=focal_px, world_from_camera=Pose.from_transform(pose)
    )


def _facing(forward: Array, right: Array) -> Array:
    """(3, 3) world from camera axes of who looks along `forward` and has about the same right."""
    forward = forward / np.linalg.norm(forward)
    right = right - forward * (right @ forward)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)
