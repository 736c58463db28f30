"""Planar reflections on level wet ground, rendered from a camera below the ground.

A plane mirror shows the view of the camera that is mirrored at its plane.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.noise import sampled
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage
from gear.values.geometry import Array, RigidTransform
from gear.values.scene import CameraRecord, Pose

_Floats = npt.NDArray[np.float32]

MirrorView = tuple[RawView, CameraRecord]
"""A render from `mirror_camera`, and that camera."""

SHARE_PX = 0.5
"""Resolution relative to the picture: ripples and rough ground show less detail than a mirror."""

_RAYS = (33, 65)
"""Columns and rows of rays that determine which part of the street the picture can reflect."""

_STEP_PX, _MARGIN_PX = 32, 8
"""Sizes are multiples of a step, since renderers keep buffers for each size."""

_STEEPEST = 0.2
"""Least cosine between the mirror camera's axis and a ray."""

_UNDER_M = 0.05
_BLUR_RAD = (0.008, 0.04)
"""Standard deviations of the blur across and along the view on damp ground, whose facets stretch reflections."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Reflection:
    """The reflected street.

    Attributes:
        camera: the mirror camera.
        height_m: height of the mirror in the world.
        sharp: (h, w, 4) float32: light times the known share, 1.0 being the frame's full scale, and the known share
            0..1. Objects below the mirror hide the reflection, which is unknown there.
        soft: the same, blurred as on damp ground.
    """

    camera: CameraRecord
    height_m: float
    sharp: _Floats
    soft: _Floats

    @staticmethod
    def of(view: RawView, camera: CameraRecord, height_m: float) -> Reflection:
        """The reflection from a render of the world without its ground.

        Args:
            view: the render of `camera`.
            camera: from `mirror_camera`.
            height_m: height of the mirror in the world.
        """
        assert view.linear_rgb is not None
        at_m = np.nan_to_num(view.depth_m, nan=np.inf) * _climb(camera) + camera.world_from_camera.position_m[2]
        known = (at_m > height_m - _UNDER_M).astype(np.float32)[..., None]
        sharp = np.concatenate([view.linear_rgb * (known / np.float32(LINEAR_FULL_SCALE)), known], axis=-1)
        across, along = (rad * camera.focal_px for rad in _BLUR_RAD)
        soft = cv2.GaussianBlur(sharp, (0, 0), across, sigmaY=along, borderType=cv2.BORDER_REPLICATE)
        return Reflection(camera=camera, height_m=height_m, sharp=sharp, soft=np.asarray(soft, dtype=np.float32))

    def at(self, picture: _Floats, east: _Floats, north: _Floats, up: _Floats) -> _Floats:
        """(N, 4) reads of `sharp` or `soft` in directions with components (N,), of any length."""
        x, y, z = (
            axis[0] * east + axis[1] * north + axis[2] * up
            for axis in self.camera.world_from_camera_transform.rotation.T.astype(np.float32)
        )
        z = np.maximum(z, np.float32(1e-6))
        pinhole = self.camera.intrinsics
        column = x / z * np.float32(pinhole.fx_px) + np.float32(pinhole.cx_px)
        row = y / z * np.float32(pinhole.fy_px) + np.float32(pinhole.cy_px)
        return sampled(picture, column, row, is_periodic=False)


def mirror_camera(camera: CameraRecord, height_m: float) -> CameraRecord | None:
    """The camera whose render a level mirror shows to a camera; None where the camera sees no ground.

    It is symmetric, level, and as large as needed to cover all reflected rays.

    Args:
        camera: the camera above the mirror.
        height_m: height of the mirror in the world.
    """
    world_from_camera = camera.world_from_camera_transform
    pinhole = camera.intrinsics
    columns, rows = np.meshgrid(
        np.linspace(-0.5, 0.5, _RAYS[0]) * camera.width_px + ((camera.width_px - 1) / 2 - pinhole.cx_px),
        np.linspace(-0.5, 0.5, _RAYS[1]) * camera.height_px + ((camera.height_px - 1) / 2 - pinhole.cy_px),
    )
    rays = np.stack(
        [columns.ravel(), rows.ravel() * (pinhole.fx_px / pinhole.fy_px), np.full(columns.size, pinhole.fx_px)]
    )
    rays = (world_from_camera.rotation @ (rays / np.linalg.norm(rays, axis=0))).T
    # Including the horizon, which lies between two rays.
    step = max(camera.width_px / (_RAYS[0] - 1) / pinhole.fx_px, camera.height_px / (_RAYS[1] - 1) / pinhole.fy_px)
    seen = rays[rays[:, 2] < step]
    if not (rays[:, 2] < 0).any() or world_from_camera.translation_m[2] <= height_m:
        return None
    mirrored = np.column_stack([seen[:, :2], np.maximum(-seen[:, 2], 0)])
    rotation = _facing(mirrored.mean(axis=0), world_from_camera.rotation)
    ahead = mirrored @ rotation
    reach = np.abs(ahead[:, :2] / np.maximum(ahead[:, 2:], _STEEPEST)).max(axis=0)
    focal_px = SHARE_PX * camera.focal_px
    width_px, height_px = (_STEP_PX * int(np.ceil(2 * (side * focal_px + _MARGIN_PX) / _STEP_PX)) for side in reach)
    position_m = world_from_camera.translation_m * (1, 1, -1) + (0, 0, 2 * height_m)
    pose = RigidTransform.from_parts("world", "camera", rotation, position_m)
    return replace(
        camera,
        width_px=width_px,
        height_px=height_px,
        focal_px=focal_px,
        focal_y_px=None,
        principal_px=None,
        world_from_camera=Pose.from_transform(pose),
    )


def beyond_mirror(depth_m: FloatImage, camera: CameraRecord, height_m: float) -> tuple[FloatImage, CameraRecord]:
    """The part of each ray beyond the mirror, as depth from a camera at the height of the mirror.

    Args:
        depth_m: (h, w) of the mirror camera.
        camera: the mirror camera.
        height_m: height of the mirror in the world.
    """
    x, y, z = camera.world_from_camera.position_m
    leg_m = np.float32(height_m - z) / np.maximum(_climb(camera), np.float32(1e-6))
    pose = replace(camera.world_from_camera, position_m=(x, y, height_m))
    return np.asarray(np.maximum(depth_m - leg_m, 0), dtype=np.float32), replace(camera, world_from_camera=pose)


def _climb(camera: CameraRecord) -> _Floats:
    """(h, w) height gained per metre of depth."""
    pinhole = camera.intrinsics
    x = (np.arange(camera.width_px, dtype=np.float32) - pinhole.cx_px) / pinhole.fx_px
    y = (np.arange(camera.height_px, dtype=np.float32)[:, None] - pinhole.cy_px) / pinhole.fy_px
    up = camera.world_from_camera_transform.rotation[2]
    return np.asarray(up[0] * x + up[1] * y + up[2], dtype=np.float32)


def _facing(forward: Array, rotation: Array) -> Array:
    """(3, 3) world-from-camera rotation that looks along `forward` without roll; like `rotation` where it looks up."""
    forward = forward / np.linalg.norm(forward)
    level = np.cross(forward, (0, 0, 1))
    right = level if np.linalg.norm(level) > 0.1 else rotation[:, 0] - forward * (rotation[:, 0] @ forward)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)
