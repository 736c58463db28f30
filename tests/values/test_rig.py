"""Cameras on the car: rotations, pinholes and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gear.plugins.tasks.stereo3d import LEFT, RIGHT, Stereo3dConfig, Stereo3dTask
from gear.values.errors import FieldError
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig

HERE = RigidTransform.from_yaw("world", "ego", (3.0, 4.0, 0.5), 0.7)


def mount(**options: Any) -> CameraMount:
    return CameraMount(name="c", width_px=200, height_px=100, **options)


def test_a_positive_roll_lowers_the_right_side_of_the_camera() -> None:
    right = mount(roll_deg=30).ego_from_camera.rotation[:, 0]
    np.testing.assert_allclose(right, [0, -math.cos(math.radians(30)), -0.5], atol=1e-12)


def test_own_focal_lengths_and_principal_point_reach_the_record() -> None:
    own = mount(hfov_deg=50, focal_px=120.0, focal_y_px=110.0, principal_px=(90.0, 60.0))
    (camera,) = Rig(cameras=(own,)).place(HERE)
    pinhole = camera.intrinsics
    assert pinhole == own.intrinsics and not pinhole.is_symmetric
    np.testing.assert_allclose(pinhole.matrix, [[120, 0, 90], [0, 110, 60], [0, 0, 1]])
    np.testing.assert_allclose(pinhole.project([0.5, -0.2, 2.0]), [90 + 30, 60 - 11])
    np.testing.assert_allclose(pinhole.unproject([120, 49], 2.0), [0.5, -0.2, 2.0])
    assert math.degrees(mount(hfov_deg=50).intrinsics.hfov_rad) == pytest.approx(50)
    assert pinhole.hfov_rad == pytest.approx(math.atan(109.5 / 120) + math.atan(90.5 / 120))
    assert pinhole.vfov_rad == pytest.approx(math.atan(39.5 / 110) + math.atan(60.5 / 110))


@pytest.mark.parametrize("pose", [{}, {"pitch_deg": 10.0}, {"roll_deg": 20.0}, {"pitch_deg": 10.0, "roll_deg": -35.0}])
def test_a_stereo_pair_is_rectified_however_it_is_turned(pose: dict[str, float]) -> None:
    """The right camera lies on the left one's horizontal axis, as far away as the baseline says."""
    config = Stereo3dConfig(**pose)
    left, right = (camera.world_from_camera_transform for camera in Stereo3dTask(config).rig().place(HERE))
    between = (left.inverse() @ right).matrix
    expected = np.eye(4)
    expected[0, 3] = config.baseline_m
    np.testing.assert_allclose(between, expected, atol=3e-6)
    assert [mount.name for mount in Stereo3dTask(config).rig().cameras] == [LEFT, RIGHT]
    assert config.is_level == (not pose)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"focal_px": 5.0}, "focal_px"),
        ({"focal_y_px": 1e5}, "focal_y_px"),
        ({"principal_px": (200.0, 50.0)}, "principal_px"),
        ({"principal_px": (float("nan"), 50.0)}, "principal_px"),
        ({"pitch_deg": 91.0}, "pitch_deg"),
        ({"roll_deg": 200.0}, "roll_deg"),
        ({"hfov_deg": 0.5}, "hfov_deg"),
    ],
)
def test_cameras_that_cannot_be_are_refused(options: dict[str, Any], field: str) -> None:
    with pytest.raises(FieldError) as caught:
        mount(**options)
    assert caught.value.field == field


def test_a_camera_under_the_ground_is_refused() -> None:
    with pytest.raises(FieldError, match="under the ground") as caught:
        Stereo3dConfig(position_m=(0.0, 0.0, -3.0))
    assert caught.value.field == "position_m"
