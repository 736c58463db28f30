"""The motion of the rig, against a circle in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from gear.formats.driving.ego_motion import GRAVITY_MPS2, EgoMotion, poses_from_first, rotation_vector
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES
from tests.formats.driving.drives import INTERVAL_S, RADIUS_M, RATE_RADPS, circle

CAMERA_RADIUS_M = math.hypot(RADIUS_M, 1.5)
SPEED_MPS = RATE_RADPS * CAMERA_RADIUS_M


def test_a_circle_in_closed_form() -> None:
    motion = EgoMotion.of(circle(9))
    assert motion.times_s == pytest.approx(np.arange(9) * INTERVAL_S)
    assert motion.rates_radps == pytest.approx(np.tile([0, 0, RATE_RADPS], (9, 1)), abs=1e-7), "also at the ends"
    outwards = motion.positions_m[:, :2] / CAMERA_RADIUS_M
    assert np.linalg.norm(outwards, axis=1) == pytest.approx(1.0)
    along = np.stack([-outwards[:, 1], outwards[:, 0]], axis=1)
    assert motion.velocities_mps[:, :2] == pytest.approx(SPEED_MPS * along, rel=0, abs=0.01)
    centripetal = SPEED_MPS * RATE_RADPS
    assert motion.accelerations_mps2[1:-1, :2] == pytest.approx(-centripetal * outwards[1:-1], rel=0, abs=2e-3)
    assert motion.velocities_mps[:, 2] == pytest.approx(np.zeros(9))


def test_errors_are_of_second_order_in_the_interval() -> None:
    errors = []
    for interval_s in (0.2, 0.1):
        motion = EgoMotion.of(circle(5, interval_s=interval_s))
        speeds = np.linalg.norm(motion.velocities_mps, axis=1)
        errors.append(np.abs(speeds - SPEED_MPS)[1:-1].max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)


def test_an_accelerometer_reads_gravity_upwards_and_the_curve_to_the_left() -> None:
    measured = EgoMotion.of(circle(9)).measured_mps2[1:-1]
    assert measured[:, 2] == pytest.approx(np.full(7, GRAVITY_MPS2))
    # The centre of the circle is exactly left of the middle of the car, and a little behind the camera.
    left, behind = RADIUS_M * RATE_RADPS**2, 1.5 * RATE_RADPS**2
    assert measured[:, :2] == pytest.approx(np.tile([-behind, left], (7, 1)), rel=0, abs=2e-3)


def test_angles_are_those_of_the_rotation() -> None:
    def turned(axis: tuple[float, float, float], angle_rad: float) -> np.ndarray:
        return np.asarray(cv2.Rodrigues(np.array(axis) * angle_rad)[0])

    wanted = np.array([0.1, -0.2, 2.5])
    rotation = turned((0, 0, 1), wanted[2]) @ turned((0, 1, 0), wanted[1]) @ turned((1, 0, 0), wanted[0])
    motion = replace(EgoMotion.of(circle(2)), rotations=rotation[None])
    assert motion.roll_pitch_yaw_rad[0] == pytest.approx(wanted)


def test_a_rotation_vector_is_that_of_opencv() -> None:
    for vector in ([0.3, -0.2, 1.1], [1e-7, 0.0, 2e-7], [0.0, 0.0, 0.0], [3.0, 0.0, 0.1]):
        assert rotation_vector(cv2.Rodrigues(np.array(vector))[0]) == pytest.approx(vector, abs=1e-12)


def test_two_frames_have_a_velocity_and_no_acceleration() -> None:
    motion = EgoMotion.of(circle(2))
    assert np.linalg.norm(motion.velocities_mps, axis=1) == pytest.approx([SPEED_MPS] * 2, rel=1e-3)
    assert not motion.accelerations_mps2.any()


def test_a_single_frame_has_no_motion() -> None:
    with pytest.raises(ValueError, match="at least two frames"):
        EgoMotion.of(circle(1))
    first, second = circle(2)
    with pytest.raises(ValueError, match="times increase"):
        EgoMotion.of([first, replace(second, time_s=0.0)])


def test_poses_begin_with_the_identity_and_end_where_the_car_is() -> None:
    records = circle(9)
    poses = poses_from_first(records)
    assert np.array_equal(poses[0].matrix, np.eye(4)), "exactly"
    angle_rad = RATE_RADPS * INTERVAL_S * 8
    chord_m = 2 * CAMERA_RADIUS_M * math.sin(angle_rad / 2)
    x, y, z = poses[-1].translation_m
    assert math.hypot(x, z) == pytest.approx(chord_m, abs=1e-5)
    assert x < 0 < z and y == pytest.approx(0, abs=1e-9), "ahead and to the left"
    turn = CAMERA_FROM_ACTOR_AXES.T @ poses[-1].rotation @ CAMERA_FROM_ACTOR_AXES
    assert rotation_vector(turn) == pytest.approx([0, 0, angle_rad], abs=1e-7)
