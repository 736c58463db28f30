"""Files of KITTI's raw data: measurements of the inertial and satellite navigation system (OXTS), times, calibration.

The system is exact, and it stands at the left camera with the axes of the laser scanner (x forward, y left, z up). The
town has no place on Earth: its origin is put at latitude 0 and longitude 0, where the Mercator projection that KITTI's
development kit uses (`convertOxtsToPose`) is true to scale.
"""

from __future__ import annotations

import datetime
import math

import numpy as np

from gear.formats.driving.ego_motion import EgoMotion
from gear.formats.kitti_object import VELODYNE_TO_CAMERA, Calibration
from gear.values.geometry import Array

EARTH_RADIUS_M = 6378137.0
"""Radius of the Earth in KITTI's development kit, metres."""

FIELDS = (
    "lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu pos_accuracy vel_accuracy "
    "navstat numsats posmode velmode orimode"
)
"""Names of the 30 numbers in a line, in order, as KITTI calls them."""

STATUS = "0.0 0.0 0 0 0 0 0"
"""The last seven numbers: the accuracy is exact, and no satellite receiver has a status."""

DESCRIPTION = f"""{FIELDS}

lat, lon, alt: position, degrees and metres; the town's origin has latitude 0, longitude 0 and altitude 0
roll, pitch, yaw: radians; left side up, front down, and counter-clockwise from east are positive
vn, ve, vf, vl, vu: velocity to the north, east, front, left (both level) and upwards, m/s
ax, ay, az, af, al, au: readings of the accelerometer, in the axes of the rig and level, m/s^2, with gravity upwards
wx, wy, wz, wf, wl, wu: rotation rates about the axes of the rig and about level axes, rad/s
pos_accuracy, vel_accuracy, navstat, numsats, posmode, velmode, orimode: 0, because the numbers are not measured

Velocities, accelerations and rates are central differences of the exact poses of neighbouring frames.
"""


def oxts_lines(motion: EgoMotion) -> list[str]:
    """The lines of KITTI's OXTS files, one line of 30 numbers for each frame, without newlines. Each file has one
    line.

    Args:
        motion: the motion of the camera rig through the sequence.
    """
    angles = motion.roll_pitch_yaw_rad
    force, rates_world = motion.measured_mps2, np.einsum("nij,nj->ni", motion.rotations, motion.rates_radps)
    force_world = np.einsum("nij,nj->ni", motion.rotations, force)
    lines = []
    for frame, position_m in enumerate(motion.positions_m):
        level = _level_from_world(angles[frame, 2])
        velocity = motion.velocities_mps[frame]
        place = (_latitude_deg(position_m[1]), _longitude_deg(position_m[0]), position_m[2])
        numbers = [
            *angles[frame],
            velocity[1],
            velocity[0],
            *(level @ velocity),
            *force[frame],
            *(level @ force_world[frame]),
            *motion.rates_radps[frame],
            *(level @ rates_world[frame]),
        ]
        fields = [*(f"{value + 0.0:.14f}" for value in place), *(f"{value + 0.0:.12g}" for value in numbers)]
        lines.append(" ".join([*fields, STATUS]))
    return lines


def _level_from_world(yaw_rad: float) -> Array:
    """(3, 3) rotation from world axes to level axes with x in the direction `yaw_rad`."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _latitude_deg(north_m: float) -> float:
    return 360 / math.pi * math.atan(math.exp(north_m / EARTH_RADIUS_M)) - 90


def _longitude_deg(east_m: float) -> float:
    return math.degrees(east_m / EARTH_RADIUS_M)


def timestamps(day: datetime.date, times_s: Array) -> bytes:
    """The bytes of a file `timestamps.txt`: date and time of each frame, to the nanosecond; sequences start at noon.

    Args:
        day: date of the drive.
        times_s: (N,) times of the frames in seconds from the first frame.
    """
    lines = []
    for time_s in times_s:
        seconds, nanoseconds = divmod(round(float(time_s) * 1e9), 1_000_000_000)
        moment = datetime.datetime.combine(day, datetime.time(12)) + datetime.timedelta(seconds=seconds)
        lines.append(f"{moment:%Y-%m-%d %H:%M:%S}.{nanoseconds:09d}\n")
    return "".join(lines).encode()


def calibration_files(calibration: Calibration) -> dict[str, bytes]:
    """The three calibration files of a day of KITTI's raw data, by name.

    Args:
        calibration: the calibration of the cameras.

    Returns:
        Bytes by file name: `calib_cam_to_cam.txt`, `calib_imu_to_velo.txt`, `calib_velo_to_cam.txt`.
    """
    size = (calibration.intrinsics.width_px, calibration.intrinsics.height_px)
    cameras: list[tuple[str, Array]] = [("corner_dist", np.zeros(1))]
    for camera in range(4):
        right_m = calibration.baseline_m if camera in (1, 3) else 0.0
        values = {
            "S": np.array(size),
            "K": calibration.intrinsics.matrix,
            "D": np.zeros(5),
            "R": np.eye(3),
            "T": np.array([-right_m, 0.0, 0.0]),
            "S_rect": np.array(size),
            "R_rect": np.eye(3),
            "P_rect": calibration.projection(camera),
        }
        cameras += [(f"{name}_{camera:02d}", value) for name, value in values.items()]
    scanner = np.array(VELODYNE_TO_CAMERA)
    return {
        "calib_cam_to_cam.txt": _rows(cameras),
        "calib_velo_to_cam.txt": _rows(
            [("R", scanner[:, :3]), ("T", scanner[:, 3]), ("delta_f", np.zeros(2)), ("delta_c", np.zeros(2))]
        ),
        "calib_imu_to_velo.txt": _rows([("R", np.eye(3)), ("T", np.zeros(3))]),
    }


def _rows(values: list[tuple[str, Array]]) -> bytes:
    lines = (f"{name}: " + " ".join(f"{value + 0.0:.12e}" for value in array.reshape(-1)) for name, array in values)
    return "".join(f"{line}\n" for line in ("calib_time: 01-Jan-2022 12:00:00", *lines)).encode()
