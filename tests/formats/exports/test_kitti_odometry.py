"""KITTI odometry: sequences with pictures, and one pose file for each."""

from __future__ import annotations

import numpy as np
import pytest

from gear.formats.driving.kitti_poses import parse_poses
from gear.formats.exports.kitti_odometry import kitti_odometry_tree
from gear.formats.exports.layout import NoOptions
from gear.values.errors import DatasetError
from tests.formats.driving.drives import circle, split_with


def test_each_sequence_has_pictures_and_poses() -> None:
    records = (*circle(3, is_stereo=True), *circle(2, sequence=1, start=3, is_stereo=True))
    files = dict(kitti_odometry_tree([split_with(records, "stereo3d")], str.encode, NoOptions()))
    assert files["sequences/00/image_3/000002.png"] == b"video/image_3/000002.png"
    assert files["sequences/01/image_2/000001.png"] == b"video/image_2/000004.png"
    assert len(files) == 2 * 5 + 2 * 3
    assert files["sequences/01/times.txt"] == b"0.000000e+00\n1.000000e-01\n"
    poses = parse_poses(files["poses/00.txt"].decode())
    assert poses.shape == (3, 3, 4) and poses[0] == pytest.approx(np.eye(3, 4))
    world = [record.cameras[0].world_from_camera_transform.matrix for record in records[:3]]
    assert poses[2] == pytest.approx((np.linalg.inv(world[0]) @ world[2])[:3], abs=1e-8)


def test_one_camera_is_enough() -> None:
    files = dict(kitti_odometry_tree([split_with(circle(2), "depth")], str.encode, NoOptions()))
    assert [path for path in files if "image" in path] == [f"sequences/00/image_2/00000{i}.png" for i in range(2)]


def test_single_pictures_are_refused() -> None:
    with pytest.raises(DatasetError, match="driving sequences"):
        dict(kitti_odometry_tree([split_with(circle(1), "depth")], str.encode, NoOptions()))
