"""Checks that the faces, which show patches, are well visible to the reference camera (the first camera of the rig)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from gear.values.geometry import Array, RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import CameraRecord
from gear.world.placement import PlacementSpace
from gear.world.surfaces.patch_faces import Face

PICTURE_MARGIN = 0.06
"""Smallest distance of a face's middle from the border of the picture, as a share of the picture's width and height."""

GRID = (5, 3)
"""Numbers of columns and rows of points on a face for which lines of sight are tested."""
STAND_OFF_M = 0.2
"""Lines of sight end this far in front of a face, metres, so that they do not hit its own board."""

TRUCK_MAX_INCIDENCE_DEG = 75.0

Verdict = Literal["seen", "out of the picture", "too oblique", "hidden"]


@dataclass(frozen=True, slots=True, eq=False)
class FaceInWorld:
    """A face in world coordinates.

    Attributes:
        centre_m: (3,) middle of the face.
        outward: (3,) unit normal that points away from the board.
        grid_m: (15, 3) points spread over the face, `STAND_OFF_M` in front of it.
    """

    centre_m: Array
    outward: Array
    grid_m: Array

    @staticmethod
    def of(face: Face, world_from_surface: RigidTransform) -> FaceInWorld:
        """Converts a face to world coordinates.

        Args:
            face: the face.
            world_from_surface: world pose of its surface frame, whose z axis points into the board.
        """
        u, v = np.meshgrid((np.arange(GRID[0]) + 0.5) / GRID[0] - 0.5, (np.arange(GRID[1]) + 0.5) / GRID[1] - 0.5)
        local_m = np.stack([u * face.width_m, v * face.height_m, np.full(u.shape, -STAND_OFF_M)], axis=-1)
        return FaceInWorld(
            world_from_surface.translation_m,
            -world_from_surface.rotation[:, 2],
            world_from_surface.apply(local_m.reshape(-1, 3)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewLimits:
    """Limits for the visibility of each face to the reference camera.

    Attributes:
        max_incidence_deg: largest angle between the face's normal and the direction to the camera.
        min_free: smallest share of the face that the town and its boards must leave visible.
    """

    max_incidence_deg: float = TRUCK_MAX_INCIDENCE_DEG
    min_free: float = 0.4

    def judge(
        self, space: PlacementSpace, faces: Sequence[FaceInWorld], mount: CameraMount, camera: CameraRecord
    ) -> Verdict:
        """Tests whether all faces are well visible to a camera; cheap tests come first.

        Args:
            space: the placement model, for lines of sight.
            faces: the faces in world coordinates.
            mount: the camera's intrinsics and picture size.
            camera: the camera's pose in world coordinates.

        Returns:
            The first limit that a face breaks (`out of the picture`, `too oblique` or `hidden`), or `seen`.
        """
        world_from_camera = camera.world_from_camera_transform
        eye_m = world_from_camera.translation_m
        camera_from_world = world_from_camera.inverse()
        for face in faces:
            centre_m = camera_from_world.apply(face.centre_m)
            if centre_m[2] <= 0.5:
                return "out of the picture"
            u, v = mount.intrinsics.project(centre_m)
            margin_u, margin_v = PICTURE_MARGIN * mount.width_px, PICTURE_MARGIN * mount.height_px
            if not (margin_u <= u <= mount.width_px - margin_u and margin_v <= v <= mount.height_px - margin_v):
                return "out of the picture"
            to_eye = eye_m - face.centre_m
            cosine = float(to_eye @ face.outward) / float(np.linalg.norm(to_eye))
            if cosine < math.cos(math.radians(self.max_incidence_deg)):
                return "too oblique"
        for face in faces:
            if float(np.mean(space.visible(eye_m, face.grid_m))) < self.min_free:
                return "hidden"
        return "seen"


def reference_camera(rig: Rig, world_from_ego: RigidTransform) -> tuple[CameraMount, CameraRecord]:
    """The reference camera (the first camera of a rig), and its record for a world pose of the ego car.

    Args:
        rig: the cameras on the ego car.
        world_from_ego: world pose of the ego car.
    """
    return rig.cameras[0], rig.place(world_from_ego)[0]
