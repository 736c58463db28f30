"""KITTI's raw data, read as its development kit reads them."""

from __future__ import annotations

import datetime

import numpy as np
import pytest

from gear.formats.driving.ego_motion import GRAVITY_MPS2, EgoMotion
from gear.formats.driving.oxts import DESCRIPTION, FIELDS, calibration_files, oxts_lines, timestamps
from gear.formats.kitti_object import Calibration, parse_calibration
from gear.values.geometry import Intrinsics
from tests.formats.driving.drives import RATE_RADPS, circle


def devkit_poses(lines: list[str]) -> np.ndarray:
    """`convertOxtsToPose.m` of the development kit: (N, 4, 4), relative to the first frame."""
    packets = np.array([[float(field) for field in line.split()] for line in lines])
    scale = np.cos(packets[0, 0] * np.pi / 180.0)
    poses = []
    for lat, lon, alt, roll, pitch, yaw in packets[:, :6]:
        er = 6378137.0
        t = [scale * lon * np.pi * er / 180, scale * er * np.log(np.tan((90 + lat) * np.pi / 360)), alt]
        cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (np.cos, np.sin))
        rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rz @ ry @ rx, t
        poses.append(pose)
    return np.linalg.inv(poses[0]) @ np.array(poses)


def test_the_development_kit_finds_the_poses() -> None:
    motion = EgoMotion.of(circle(9))
    found = devkit_poses(oxts_lines(motion))
    first = motion.rotations[0]
    assert found[:, :3, 3] == pytest.approx((motion.positions_m - motion.positions_m[0]) @ first, abs=1e-6)
    assert found[:, :3, :3] == pytest.approx(first.T @ motion.rotations, abs=1e-9)


def test_the_numbers_have_the_meaning_of_their_names() -> None:
    motion = EgoMotion.of(circle(9))
    lines = oxts_lines(motion)
    assert {len(line.split()) for line in lines} == {30} and len(FIELDS.split()) == 30
    packet = dict(zip(FIELDS.split(), (float(field) for field in lines[4].split()), strict=True))
    speed_mps = RATE_RADPS * 20
    assert packet["vf"] == pytest.approx(speed_mps, rel=1e-3)
    assert packet["vl"] == pytest.approx(RATE_RADPS * 1.5, rel=1e-3), "the camera is in front of the middle"
    assert np.hypot(packet["vn"], packet["ve"]) == pytest.approx(np.hypot(packet["vf"], packet["vl"]))
    assert packet["ve"] == pytest.approx(motion.velocities_mps[4, 0])
    assert packet["ay"] == pytest.approx(speed_mps * RATE_RADPS, rel=1e-3)
    assert (packet["az"], packet["au"]) == pytest.approx((GRAVITY_MPS2, GRAVITY_MPS2))
    assert (packet["wz"], packet["wu"]) == pytest.approx((RATE_RADPS, RATE_RADPS))
    assert packet["alt"] == pytest.approx(0.5 + 1.65)
    assert DESCRIPTION.startswith(FIELDS)


def test_times_have_nanoseconds() -> None:
    text = timestamps(datetime.date(2022, 1, 31), np.array([0.0, 0.1, 60.05])).decode()
    assert text.splitlines() == [
        "2022-01-31 12:00:00.000000000", "2022-01-31 12:00:00.100000000", "2022-01-31 12:01:00.050000000",
    ]  # fmt: skip


def test_calibration_of_both_cameras() -> None:
    files = calibration_files(Calibration(intrinsics=Intrinsics(32, 16, 16.0), baseline_m=0.5))
    assert sorted(files) == ["calib_cam_to_cam.txt", "calib_imu_to_velo.txt", "calib_velo_to_cam.txt"]
    text = files["calib_cam_to_cam.txt"].decode()
    values = {line.split(": ")[0]: line.split(": ")[1].split() for line in text.splitlines()}
    assert [float(v) for v in values["P_rect_03"]] == [16, 0, 15.5, -8, 0, 16, 7.5, 0, 0, 0, 1, 0]
    assert [float(v) for v in values["S_rect_02"]] == [32, 16] and float(values["T_03"][0]) == -0.5
    imu = files["calib_imu_to_velo.txt"].decode().split("\n", 1)[1]
    assert parse_calibration(imu)["R"].tolist() == np.eye(3).tolist()
