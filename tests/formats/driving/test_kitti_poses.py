"""Files of KITTI's odometry benchmark."""

from __future__ import annotations

import numpy as np
import pytest

from gear.formats.driving.ego_motion import poses_from_first
from gear.formats.driving.kitti_poses import format_odometry_calibration, format_poses, format_times, parse_poses
from gear.formats.kitti_object import Calibration, parse_calibration
from gear.values.geometry import Intrinsics
from tests.formats.driving.drives import circle


def test_poses_are_read_back() -> None:
    poses = poses_from_first(circle(4))
    text = format_poses(poses).decode()
    assert [len(line.split()) for line in text.splitlines()] == [12] * 4
    assert text.startswith("1.000000000e+00 0.000000000e+00 ")
    assert parse_poses(text) == pytest.approx(np.array([pose.matrix[:3] for pose in poses]), abs=1e-9)
    with pytest.raises(ValueError):
        parse_poses("1 2 3\n")


def test_times_count_from_the_first_frame() -> None:
    assert format_times([5.0, 5.1, 5.2]).decode().split() == ["0.000000e+00", "1.000000e-01", "2.000000e-01"]


def test_calibration_has_the_five_lines_of_the_benchmark() -> None:
    text = format_odometry_calibration(Calibration(intrinsics=Intrinsics(32, 16, 16.0), baseline_m=0.5)).decode()
    matrices = parse_calibration(text)
    assert list(matrices) == ["P0", "P1", "P2", "P3", "Tr"]
    assert matrices["P3"].tolist() == [[16, 0, 15.5, -8], [0, 16, 7.5, 0], [0, 0, 1, 0]]
    assert matrices["Tr"][:, :3] @ [1, 0, 0] == pytest.approx([0, 0, 1]), "the scanner looks ahead"
