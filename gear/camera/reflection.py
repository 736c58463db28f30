"""Reflections on level wet ground, rendered by a mirrored camera below the ground.

A plane mirror shows what a camera at the mirrored position would see.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.fractal import sampled
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage
from gear.values.geometry import Array, RigidTransform
from gear.values.scene import CameraRecord, Pose

_Floats = npt.NDArray[np.float32]

MirrorView = tuple[RawView, CameraRecord]
"""A view that the mirrored camera renders, and the mirrored camera itself (`mirror_camera`)."""

SHARE_PX = 0.5
"""Resolution of the reflection as a share of the picture's resolution. It is lower, because ripples and rough ground
hide detail.
"""

_RAYS = (33, 65)
"""Numbers of columns and rows of test rays. They determine the part of the street that the picture can reflect."""

_STEP_PX, _MARGIN_PX = 32, 8
"""Two lengths in pixels. The sizes of reflections are multiples of the first, because renderers keep buffers for each
size. The second is a margin.
"""

_STEEPEST = 0.2
"""Smallest cosine between the mirrored camera's axis and a ray."""

_UNDER_M = 0.05
_BLUR_RAD = (0.008, 0.04)
"""Standard deviations of the blur on damp ground, across and along the direction of view, in radians."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Reflection:
    """The mirror image of the street in a level mirror at the height of the ground.

    Attributes:
        camera: the mirrored camera.
        height_m: height of the mirror in world coordinates.
        sharp: (h, w, 4) float32. The last channel is the share 0..1 of the pixel whose reflection is known; the others
            are light times that share (1.0 is the frame's full scale). The reflection is unknown where objects below
            the mirror hide it.
        soft: `sharp`, blurred as on damp ground.
    """

    camera: CameraRecord
    height_m: float
    sharp: _Floats
    soft: _Floats

    @staticmethod
    def of(view: RawView, camera: CameraRecord, height_m: float) -> Reflection:
        """Makes the reflection from a rendered view of the world without its ground.

        Args:
            view: the view that `camera` renders.
            camera: the mirrored camera, from `mirror_camera`.
            height_m: height of the mirror in world coordinates.
        """
        assert view.linear_rgb is not None
        at_m = np.nan_to_num(view.depth_m, nan=np.inf) * _climb(camera) + camera.world_from_camera.position_m[2]
        known = (at_m > height_m - _UNDER_M).astype(np.float32)[..., None]
        sharp = np.concatenate([view.linear_rgb * (known / np.float32(LINEAR_FULL_SCALE)), known], axis=-1)
        across, along = (rad * camera.focal_px for rad in _BLUR_RAD)
        soft = cv2.GaussianBlur(sharp, (0, 0), across, sigmaY=along, borderType=cv2.BORDER_REPLICATE)
        return Reflection(camera=camera, height_m=height_m, sharp=sharp, soft=np.asarray(soft, dtype=np.float32))

    def at(self, picture: _Floats, east: _Floats, north: _Floats, up: _Floats) -> _Floats:
        """Reads the reflection in N directions: (N, 4) values of `sharp` or `soft`.

        Args:
            picture: `sharp` or `soft`.
            east, north, up: (N,) components of the directions, which may have any length.
        """
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
    """Returns the mirrored camera, whose view is what a level mirror reflects to a camera; None if the camera sees
    no ground or is not above the mirror.

    The mirrored camera has no roll, and its principal point is the middle of its picture. The picture is just large
    enough for all reflected rays.

    Args:
        camera: the camera above the mirror.
        height_m: height of the mirror in world coordinates.
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
    # The horizon lies between two rays, so the rays just above it are included.
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
    """Cuts the rays of the mirrored camera at the mirror, so that fog can be applied to the part above it.

    Args:
        depth_m: (h, w) planar z of the mirrored camera.
        camera: the mirrored camera, below the mirror.
        height_m: height of the mirror in world coordinates.

    Returns:
        The (h, w) float32 planar z that remains above the mirror, at least 0, and the same camera moved up to the
        mirror.
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
    """(3, 3) world-from-camera rotation that looks along `forward` without roll. Where `forward` is vertical,
    the up direction of `rotation` is used.
    """
    forward = forward / np.linalg.norm(forward)
    level = np.cross(forward, (0, 0, 1))
    right = level if np.linalg.norm(level) > 0.1 else rotation[:, 0] - forward * (rotation[:, 0] @ forward)
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)
