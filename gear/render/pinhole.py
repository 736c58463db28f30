"""View volumes of pinhole cameras, and conversion of depth buffers to metres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

NEAR_M = 0.1
FAR_M = 2000.0
"""Farthest distance that is rendered, metres. Reversed depth in 32-bit floats is precise over this range."""


@dataclass(frozen=True, slots=True, eq=False)
class Frustum:
    """The view volume of a pinhole camera, in world coordinates.

    Attributes:
        position_world_m: (3,) centre of the camera.
        forward_world, up_world: (3,) unit vectors.
        half_width_m, half_height_m: half the size of the picture on the near plane, which is `NEAR_M` in front of the
            camera.
        centre_right_m, centre_up_m: position of the picture's middle on the near plane, to the right of and above the
            optical axis; 0 if the principal point is the middle of the picture.
    """

    position_world_m: Array
    forward_world: Array
    up_world: Array
    half_width_m: float
    half_height_m: float
    centre_right_m: float = 0.0
    centre_up_m: float = 0.0

    @staticmethod
    def of(camera: CameraRecord) -> Frustum:
        """The view volume of the pinhole camera in a camera record. Pixel coordinates (0, 0) are the centre of the
        picture's first pixel.

        Args:
            camera: the camera's record; its lens is ignored.
        """
        world_from_camera, pinhole = camera.world_from_camera_transform, camera.intrinsics
        return Frustum(
            position_world_m=world_from_camera.translation_m,
            forward_world=world_from_camera.rotation[:, 2],
            up_world=-world_from_camera.rotation[:, 1],
            half_width_m=NEAR_M * camera.width_px / (2 * pinhole.fx_px),
            half_height_m=NEAR_M * camera.height_px / (2 * pinhole.fy_px),
            centre_right_m=NEAR_M * ((camera.width_px - 1) / 2 - pinhole.cx_px) / pinhole.fx_px,
            centre_up_m=NEAR_M * (pinhole.cy_px - (camera.height_px - 1) / 2) / pinhole.fy_px,
        )

    def slice_corners(self, begin_m: float, end_m: float) -> Array:
        """The (8, 3) corners, in world coordinates, of the part of the view volume between two distances along the
        optical axis.

        Args:
            begin_m, end_m: planar depths at which the slice begins and ends.
        """
        right = np.cross(self.forward_world, self.up_world)
        rays = [
            self.forward_world
            + right * (self.centre_right_m + across * self.half_width_m) / NEAR_M
            + self.up_world * (self.centre_up_m + up * self.half_height_m) / NEAR_M
            for across in (-1, 1)
            for up in (-1, 1)
        ]
        return np.concatenate([self.position_world_m + distance_m * np.array(rays) for distance_m in (begin_m, end_m)])


def depth_from_reversed(reversed_depth: npt.NDArray[np.float32]) -> FloatImage:
    """Converts a reversed depth buffer (1 at `NEAR_M`, 0 at `FAR_M` and where nothing was drawn) to planar z in metres.

    Args:
        reversed_depth: (H, W) float32 depth d; it is overwritten.

    Returns:
        (H, W) float32 planar z = n f / (n + d (f - n)) in the same array, where n is `NEAR_M` and f is `FAR_M`; NaN
        where d is 0.
    """
    depth_m = reversed_depth
    nothing = depth_m <= 0
    np.multiply(depth_m, np.float32(FAR_M - NEAR_M), out=depth_m)
    np.add(depth_m, np.float32(NEAR_M), out=depth_m)
    np.divide(np.float32(NEAR_M * FAR_M), depth_m, out=depth_m)
    depth_m[nothing] = np.nan
    return depth_m
