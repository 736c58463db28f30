"""Files of KITTI's odometry benchmark: poses, times and calibration of a sequence."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from gear.formats.kitti_object import VELODYNE_TO_CAMERA, Calibration
from gear.values.geometry import Array, RigidTransform


def format_poses(poses: Iterable[RigidTransform]) -> bytes:
    """The bytes of a pose file: for each frame, the 12 numbers of the upper (3, 4) part of its pose, row by row.

    Args:
        poses: pose of the camera in each frame, in the frame of its first pose.
    """
    rows = (" ".join(f"{value + 0.0:.9e}" for value in pose.matrix[:3].reshape(-1)) for pose in poses)
    return "".join(f"{row}\n" for row in rows).encode()


def parse_poses(text: str) -> Array:
    """Parses a pose file of KITTI's odometry benchmark.

    Args:
        text: the text of the file: one line of 12 numbers per frame; empty lines are skipped.

    Returns:
        (N, 3, 4) matrices: rotation, and translation in metres, from each frame's camera to the first frame's camera.

    Raises:
        ValueError: a line does not have 12 numbers.
    """
    rows = [[float(field) for field in line.split()] for line in text.splitlines() if line.strip()]
    return np.array(rows, dtype=np.float64).reshape(len(rows), 3, 4)


def format_times(times_s: Sequence[float]) -> bytes:
    """The bytes of `times.txt`: the time of each frame in seconds, from 0 at the first frame.

    Args:
        times_s: times of the frames in seconds; the first one is subtracted from all.
    """
    return "".join(f"{time_s - times_s[0]:.6e}\n" for time_s in times_s).encode()


def format_odometry_calibration(calibration: Calibration) -> bytes:
    """The bytes of `calib.txt`: the projections P0 to P3, and Tr, from the laser scanner to camera 0.

    Args:
        calibration: the calibration of the cameras.

    Returns:
        Lines `P0` to `P3` and `Tr`, each with the 12 numbers of a (3, 4) matrix, row by row.
    """
    rows = [(f"P{camera}", calibration.projection(camera)) for camera in range(4)]
    rows.append(("Tr", np.array(VELODYNE_TO_CAMERA)))
    lines = (f"{name}: " + " ".join(f"{value + 0.0:.12e}" for value in matrix.reshape(-1)) for name, matrix in rows)
    return "".join(f"{line}\n" for line in lines).encode()
