"""Rigid transforms between named frames, and the pinhole camera.

Frames: the world is x east, y north, z up. Cameras are x right, y down, z forward. Actors are x forward, y left, z up,
with the origin on the ground in the middle of the footprint. Surfaces are x right and y down for a viewer in front of
them, z into the board. Pixels: in index pixels the centre of the first pixel is (0, 0), so a symmetric pinhole has cx =
(W - 1) / 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class FrameMismatchError(ValueError):
    """Error for two chained transforms `a_from_b @ c_from_d` whose inner frames, b and c, differ."""


def frozen(array: npt.ArrayLike, shape: tuple[int, ...] | None = None) -> Array:
    """A read-only float64 copy of an array.

    Args:
        array: any value that NumPy converts to an array.
        shape: the required shape; None for any.

    Raises:
        ValueError: the array has another shape.
    """
    copy = np.array(array, dtype=np.float64)
    if shape is not None and copy.shape != shape:
        raise ValueError(f"array must have shape {shape}, got {copy.shape}")
    copy.setflags(write=False)
    return copy


def wrap_angle_rad(angle_rad: float) -> float:
    """The equivalent angle in [-pi, pi), in radians.

    Args:
        angle_rad: any angle.
    """
    return (angle_rad + math.pi) % (2 * math.pi) - math.pi


@dataclass(frozen=True, slots=True, eq=False)
class RigidTransform:
    """The rigid transform `dst_from_src`, which converts coordinates in frame `src` to coordinates in frame `dst`.

    Attributes:
        dst, src: frame names, checked whenever transforms are chained.
        matrix: (4, 4) float64, read-only; the rotation is proper.
    """

    dst: str
    src: str
    matrix: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen(self.matrix, (4, 4)))

    @staticmethod
    def from_parts(dst: str, src: str, rotation: npt.ArrayLike, translation_m: npt.ArrayLike) -> RigidTransform:
        """Makes a transform from a (3, 3) rotation and a (3,) translation in metres.

        Args:
            dst: name of the target frame.
            src: name of the source frame.
            rotation: (3, 3) rotation matrix.
            translation_m: (3,) origin of `src` in the frame `dst`, in metres.
        """
        matrix = np.eye(4)
        matrix[:3, :3] = rotation
        matrix[:3, 3] = translation_m
        return RigidTransform(dst, src, matrix)

    @staticmethod
    def from_yaw(dst: str, src: str, position_m: npt.ArrayLike, yaw_rad: float) -> RigidTransform:
        """Makes a transform for a frame that is rotated about z, such as that of a car on level ground.

        Args:
            dst: name of the target frame.
            src: name of the source frame.
            position_m: (3,) origin of `src` in `dst`, metres.
            yaw_rad: rotation, counter-clockwise seen from above.
        """
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        return RigidTransform.from_parts(dst, src, [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], position_m)

    @property
    def rotation(self) -> Array:
        """The (3, 3) rotation matrix."""
        return self.matrix[:3, :3]

    @property
    def translation_m(self) -> Array:
        """The (3,) position of the origin of `src` in `dst`, metres."""
        return self.matrix[:3, 3]

    @property
    def yaw_rad(self) -> float:
        """Angle of the x axis of `src` about the z axis of `dst`, counter-clockwise seen from above, in radians."""
        return math.atan2(self.matrix[1, 0], self.matrix[0, 0])

    def inverse(self) -> RigidTransform:
        """The inverse transform, `src_from_dst`."""
        rotation = self.rotation.T
        return RigidTransform.from_parts(self.src, self.dst, rotation, -rotation @ self.translation_m)

    def __matmul__(self, other: RigidTransform) -> RigidTransform:
        if self.src != other.dst:
            raise FrameMismatchError(
                f"cannot chain {self.dst}_from_{self.src} @ {other.dst}_from_{other.src}:"
                f" {self.src!r} is not {other.dst!r}"
            )
        return RigidTransform(self.dst, other.src, self.matrix @ other.matrix)

    def apply(self, points_m: npt.ArrayLike) -> Array:
        """Converts (..., 3) points in frame `src` to (..., 3) points in frame `dst`, metres.

        Args:
            points_m: (..., 3) points in frame `src`.
        """
        return np.asarray(points_m, dtype=np.float64) @ self.rotation.T + self.translation_m


CAMERA_FROM_ACTOR_AXES = frozen([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Rotation from actor axes (x forward, y left, z up) to camera axes (x right, y down, z forward)."""


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Intrinsics of a pinhole camera without skew, in index pixels (the centre of the first pixel is (0, 0)).

    Attributes:
        width_px, height_px: size of the picture.
        focal_px: horizontal focal length fx.
        focal_y_px: vertical focal length fy; None for the same as `focal_px`.
        principal_px: principal point (cx, cy); None for the middle of the picture, ((W - 1) / 2, (H - 1) / 2).
    """

    width_px: int
    height_px: int
    focal_px: float
    focal_y_px: float | None = None
    principal_px: tuple[float, float] | None = None

    @staticmethod
    def from_hfov(width_px: int, height_px: int, hfov_rad: float) -> Intrinsics:
        """Makes the intrinsics of a symmetric pinhole from the horizontal field of view in radians.

        Args:
            width_px, height_px: size of the picture.
            hfov_rad: horizontal field of view in radians.
        """
        return Intrinsics(width_px, height_px, width_px / (2 * math.tan(hfov_rad / 2)))

    @property
    def fx_px(self) -> float:
        """Horizontal focal length in pixels."""
        return self.focal_px

    @property
    def fy_px(self) -> float:
        """Vertical focal length in pixels."""
        return self.focal_px if self.focal_y_px is None else self.focal_y_px

    @property
    def cx_px(self) -> float:
        """Column of the principal point, index pixels."""
        return (self.width_px - 1) / 2 if self.principal_px is None else self.principal_px[0]

    @property
    def cy_px(self) -> float:
        """Row of the principal point, index pixels."""
        return (self.height_px - 1) / 2 if self.principal_px is None else self.principal_px[1]

    @property
    def is_symmetric(self) -> bool:
        """Whether both focal lengths are equal and the principal point is the middle of the picture."""
        middle = ((self.width_px - 1) / 2, (self.height_px - 1) / 2)
        return self.fx_px == self.fy_px and (self.cx_px, self.cy_px) == middle

    @property
    def hfov_rad(self) -> float:
        """Horizontal field of view in radians, between the outer edges of the first and the last column."""
        right, left = self.width_px - 0.5 - self.cx_px, self.cx_px + 0.5
        if right == left:
            return 2 * math.atan(self.width_px / (2 * self.fx_px))
        return math.atan(right / self.fx_px) + math.atan(left / self.fx_px)

    @property
    def vfov_rad(self) -> float:
        """Vertical field of view in radians, between the outer edges of the first and the last row."""
        below, above = self.height_px - 0.5 - self.cy_px, self.cy_px + 0.5
        if below == above:
            return 2 * math.atan(self.height_px / (2 * self.fy_px))
        return math.atan(below / self.fy_px) + math.atan(above / self.fy_px)

    @property
    def matrix(self) -> Array:
        """The (3, 3) calibration matrix K in index pixels, read-only."""
        return frozen([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    def project(self, points_camera_m: npt.ArrayLike) -> Array:
        """Projects (..., 3) points in the camera frame, with z > 0, to (..., 2) index pixels.

        Args:
            points_camera_m: (..., 3) points: x right, y down, z forward, metres.
        """
        points = np.asarray(points_camera_m, dtype=np.float64)
        scaled = points[..., :2] / points[..., 2:3] * (self.fx_px, self.fy_px)
        return np.asarray(scaled + np.array([self.cx_px, self.cy_px]))

    def unproject(self, pixels: npt.ArrayLike, depth_m: npt.ArrayLike) -> Array:
        """Converts (..., 2) index pixels and (...) planar depths in metres to (..., 3) points in the camera frame.

        Args:
            pixels: (..., 2) column and row, index pixels.
            depth_m: (...) distance along the optical axis.
        """
        uv = np.asarray(pixels, dtype=np.float64)
        z = np.asarray(depth_m, dtype=np.float64)[..., None]
        return np.concatenate([(uv - (self.cx_px, self.cy_px)) / (self.fx_px, self.fy_px) * z, z], axis=-1)
