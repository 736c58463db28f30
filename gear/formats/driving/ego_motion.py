"""The motion of the camera rig through a driving sequence: poses, velocities, accelerations and rotation rates.

The rig's frame has its origin at the reference camera; its axes are x forward, y left, z up, as those of KITTI's laser
scanner. Velocities, accelerations and rates are finite differences of the poses in the records. Poses are rounded to
1e-6 m and 1e-9, so at 10 frames per second the rounding changes accelerations by at most 2e-4 m/s².
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, Array, RigidTransform
from gear.values.scene import SceneRecord

GRAVITY_MPS2 = 9.80665
"""Standard acceleration of gravity, m/s². An accelerometer at rest measures it upwards."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class EgoMotion:
    """The motion of the rig in the N frames of a sequence.

    Attributes:
        times_s: (N,) times of the frames, seconds.
        positions_m: (N, 3) positions of the reference camera in the world.
        rotations: (N, 3, 3) rotations from the rig's axes (x forward, y left, z up) to the world's axes.
        velocities_mps: (N, 3) velocities of the reference camera, world axes.
        accelerations_mps2: (N, 3) accelerations of the reference camera without gravity, world axes.
        rates_radps: (N, 3) angular velocities, rig axes, rad/s.
    """

    times_s: Array
    positions_m: Array
    rotations: Array
    velocities_mps: Array
    accelerations_mps2: Array
    rates_radps: Array

    @staticmethod
    def of(records: Sequence[SceneRecord]) -> EgoMotion:
        """The motion through the frames of one sequence, in order of time.

        The mean velocity of each interval between two frames is exact. The velocity at a frame is the mean of the two
        intervals beside it, and its acceleration their difference; the first and the last frame extrapolate. The errors
        are of second order in the interval. Rotation rates are computed in the same way.

        Args:
            records: scene records of the frames, at least two.

        Raises:
            ValueError: there are fewer than two frames, or their times do not increase.
        """
        poses = [record.cameras[0].world_from_camera_transform for record in records]
        times_s = np.array([record.time_s for record in records], dtype=np.float64)
        positions_m = np.array([pose.translation_m for pose in poses])
        rotations = np.array([pose.rotation @ CAMERA_FROM_ACTOR_AXES for pose in poses])
        intervals_s = np.diff(times_s)
        if len(records) < 2 or not (intervals_s > 0).all():
            raise ValueError("a driving sequence has at least two frames, whose times increase")
        mean_velocities = np.diff(positions_m, axis=0) / intervals_s[:, None]
        turns = [rotation_vector(before.T @ after) for before, after in pairwise(rotations)]
        accelerations = np.zeros((len(records), 3))
        if len(records) > 2:
            between_s = (intervals_s[1:] + intervals_s[:-1]) / 2
            accelerations[1:-1] = np.diff(mean_velocities, axis=0) / between_s[:, None]
            accelerations[0], accelerations[-1] = accelerations[1], accelerations[-2]
        return EgoMotion(
            times_s=times_s,
            positions_m=positions_m,
            rotations=rotations,
            velocities_mps=_at_frames(mean_velocities),
            accelerations_mps2=accelerations,
            rates_radps=_at_frames(np.array(turns) / intervals_s[:, None]),
        )

    @property
    def measured_mps2(self) -> Array:
        """(N, 3) readings of an accelerometer at the reference camera, rig axes: acceleration plus gravity, which
        points upwards.
        """
        force = self.accelerations_mps2 + np.array([0.0, 0.0, GRAVITY_MPS2])
        return np.asarray(np.einsum("nji,nj->ni", self.rotations, force))

    @property
    def roll_pitch_yaw_rad(self) -> Array:
        """(N, 3) roll, pitch and yaw of the rig, radians: the rotation is Rz(yaw) Ry(pitch) Rx(roll).

        Roll is positive with the left side up, pitch with the front down, and yaw counter-clockwise from east.
        """
        r = self.rotations
        roll = np.arctan2(r[:, 2, 1], r[:, 2, 2])
        pitch = np.arctan2(-r[:, 2, 0], np.hypot(r[:, 2, 1], r[:, 2, 2]))
        return np.stack([roll, pitch, np.arctan2(r[:, 1, 0], r[:, 0, 0])], axis=1)


def rotation_vector(rotation: Array) -> Array:
    """The (3,) rotation vector (axis times angle, radians) of a (3, 3) rotation by less than half a turn.

    Args:
        rotation: (3, 3) rotation matrix.
    """
    sines = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = float(np.linalg.norm(sines)) / 2
    if sine == 0.0:
        return np.zeros(3)
    angle_rad = math.atan2(sine, (float(np.trace(rotation)) - 1) / 2)
    return np.asarray(sines / 2 * (angle_rad / sine))


def poses_from_first(records: Sequence[SceneRecord]) -> list[RigidTransform]:
    """The poses of the reference camera in the frame of its first pose; the first pose is the identity.

    Camera axes are x right, y down, z forward, as in KITTI odometry.

    Args:
        records: scene records of the frames, in order of time.

    Returns:
        One pose per frame.
    """
    poses = [record.cameras[0].world_from_camera_transform for record in records]
    first_from_world = poses[0].inverse()
    later = [RigidTransform("first", "camera", (first_from_world @ pose).matrix) for pose in poses[1:]]
    return [RigidTransform("first", "camera", np.eye(4)), *later]


def _at_frames(means: Array) -> Array:
    """(N, 3) values at the frames, from the (N - 1, 3) means of the intervals between them."""
    values = np.empty((len(means) + 1, 3))
    values[1:-1] = (means[1:] + means[:-1]) / 2
    if len(means) == 1:
        values[:] = means[0]
    else:
        values[0] = 1.5 * means[0] - 0.5 * means[1]
        values[-1] = 1.5 * means[-1] - 0.5 * means[-2]
    return values
