"""3D boxes of objects in a camera's frame, and their projections into the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.groundtruth.silhouettes import NEAR_M
from gear.values.frames import SceneObject
from gear.values.geometry import Array, Intrinsics, frozen, wrap_angle_rad
from gear.values.ground_truth import BoxPx
from gear.values.scene import CameraRecord, Vec3

EDGES = ((0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""The 12 edges of a 3D box, as pairs of corner numbers. The bits of a corner number state its side: 4 for x, 2 for
y, 1 for z.
"""

_CORNERS = frozen([[(i >> 2 & 1) - 0.5, (i >> 1 & 1) - 0.5, i & 1] for i in range(8)])
"""(8, 3) offsets of the corners from the middle of the bottom face, as multiples of length, width and height."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Box3d:
    """A 3D box whose vertical axis is the camera's y axis (camera frame: x right, y down, z forward), as in KITTI.

    Attributes:
        height_m, width_m, length_m: size along the camera's y axis, the object's left and the object's front.
        bottom_m: middle of the bottom face.
        rotation_y_rad: rotation about the camera's y axis in [-pi, pi); 0 if the front points along +x, -pi/2 if it
            points along +z (driving away).
    """

    height_m: float
    width_m: float
    length_m: float
    bottom_m: Vec3
    rotation_y_rad: float

    @property
    def alpha_rad(self) -> float:
        """Observation angle in [-pi, pi): rotation of the object relative to the ray from the camera to the object."""
        return wrap_angle_rad(self.rotation_y_rad - math.atan2(self.bottom_m[0], self.bottom_m[2]))

    @property
    def middle_m(self) -> Vec3:
        """Middle of the box in the camera's frame, metres."""
        x, y, z = self.bottom_m
        return (x, y - self.height_m / 2, z)

    @property
    def distance_m(self) -> float:
        """Distance from the camera to the middle of the box, metres."""
        x, y, z = self.middle_m
        return math.sqrt(x * x + y * y + z * z)

    @property
    def corners_m(self) -> Array:
        """The (8, 3) corners in the camera's frame, metres, in the order that `EDGES` uses."""
        c, s = math.cos(self.rotation_y_rad), math.sin(self.rotation_y_rad)
        front, left = np.array([c, 0.0, -s]), np.array([s, 0.0, c])
        up = np.array([0.0, -self.height_m, 0.0])
        middle = np.array(self.bottom_m)
        return np.asarray(
            middle
            + _CORNERS[:, 0:1] * self.length_m * front
            + _CORNERS[:, 1:2] * self.width_m * left
            + _CORNERS[:, 2:3] * up
        )


def middle_in_camera(box_px: BoxPx, distance_m: float, pinhole: Intrinsics) -> Vec3:
    """Estimates the middle of an object in a camera's frame: the point at the object's distance on the ray through
    the middle of its 2D box.

    Args:
        box_px: box of the whole silhouette in edge pixels; it may extend beyond the picture.
        distance_m: distance from the camera to the middle of the object.
        pinhole: intrinsics of the camera.
    """
    left, top, right, bottom = box_px
    ray = pinhole.unproject([[(left + right - 1) / 2, (top + bottom - 1) / 2]], [1.0])[0]
    x, y, z = (float(v) for v in ray / np.linalg.norm(ray) * distance_m)
    return (x, y, z)


def box_in_camera(scene_object: SceneObject, camera: CameraRecord) -> Box3d:
    """The tight 3D box of an object in the camera's frame.

    The heading is the direction of the object's front, projected on the camera's x-z plane. It is exact for level
    cameras and upright objects. In other cases it is an approximation, because KITTI has a single angle, about the
    camera's y axis.

    Args:
        scene_object: the object with its pose and its visible triangles.
        camera: the camera with its pose.
    """
    camera_from_object = camera.world_from_camera_transform.inverse().matrix @ scene_object.world_from_object.matrix
    centre, (length_m, width_m, height_m) = (
        scene_object.shape.box_centre_m,
        (float(v) for v in scene_object.shape.box_size_m),
    )
    bottom = camera_from_object @ [centre[0], centre[1], centre[2] - height_m / 2, 1.0]
    front = camera_from_object[:3, 0]
    return Box3d(
        height_m=height_m,
        width_m=width_m,
        length_m=length_m,
        bottom_m=(float(bottom[0]), float(bottom[1]), float(bottom[2])),
        rotation_y_rad=wrap_angle_rad(math.atan2(-front[2], front[0])),
    )


def project_box(corners_m: Array, intrinsics: Intrinsics) -> tuple[float, float, float, float] | None:
    """Projects a 3D box into the picture and returns the 2D box around it, not clipped to the picture.

    Args:
        corners_m: (8, 3) camera-frame corners in the order of `EDGES`.
        intrinsics: intrinsics of the pinhole camera.

    Returns:
        left, top, right, bottom in index pixels. Edges that cross the near plane are cut there. None if the whole box
        lies behind the near plane.
    """
    points = corners_m if (corners_m[:, 2] >= NEAR_M).all() else _in_front(corners_m)
    if not len(points):
        return None
    pixels = intrinsics.project(points)
    (left, top), (right, bottom) = pixels.min(axis=0), pixels.max(axis=0)
    return (float(left), float(top), float(right), float(bottom))


def _in_front(corners_m: Array) -> Array:
    """(N, 3) corners in front of the near plane, and the points at which edges cross it."""
    points = [corner for corner in corners_m if corner[2] >= NEAR_M]
    for i, j in EDGES:
        a, b = corners_m[i], corners_m[j]
        if (a[2] >= NEAR_M) != (b[2] >= NEAR_M):
            cut = a + (NEAR_M - a[2]) / (b[2] - a[2]) * (b - a)
            cut[2] = NEAR_M
            points.append(cut)
    return np.array(points)


def box_of(sides: Array) -> BoxPx:
    """The box with the given left, top, right and bottom side, a (4,) array in pixels.

    Args:
        sides: (4,) left, top, right, bottom.

    Returns:
        The same numbers as floats.
    """
    left, top, right, bottom = (float(side) for side in sides)
    return (left, top, right, bottom)
