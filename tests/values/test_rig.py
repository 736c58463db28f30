"""Cameras on the car: rotations, pinholes and what is refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gear.plugins.tasks.stereo3d import LEFT, RIGHT, Stereo3dConfig, Stereo3dTask
from gear.values.errors import FieldError
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
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


def test_a_level_rig_ignores_the_slope_of_the_road() -> None:
    pitch = RigidTransform.from_parts(
        "world",
        "ego",
        [[math.cos(0.1), 0, math.sin(0.1)], [0, 1, 0], [-math.sin(0.1), 0, math.cos(0.1)]],
        (4.0, 5.0, 6.0),
    )
    mount = CameraMount(name="left", width_px=64, height_px=32)
    level = Rig(cameras=(mount,)).place(pitch)[0].world_from_camera_transform
    assert np.allclose(level.rotation @ [0, 0, 1], [1, 0, 0], atol=1e-9)
    assert np.allclose(level.translation_m, [5.5, 5.0, 7.65])
    follows = Rig(cameras=(mount,), follows_road=True).place(pitch)[0].world_from_camera_transform
    assert follows.rotation[2, 2] == pytest.approx(-math.sin(0.1), abs=1e-6)


def test_a_camera_looks_where_its_mount_says() -> None:
    mount = CameraMount(name="side", width_px=64, height_px=32, yaw_deg=90.0, position_m=(0.0, 0.0, 1.0))
    assert np.allclose(mount.ego_from_camera.rotation @ [0, 0, 1], [0, 1, 0], atol=1e-9)
    down = CameraMount(name="down", width_px=64, height_px=32, pitch_deg=30.0)
    assert (down.ego_from_camera.rotation @ [0, 0, 1])[2] == pytest.approx(-0.5)


@given(st.floats(-179, 179), st.floats(-80, 80), st.floats(-179, 179))
def test_a_mount_is_turned_by_yaw_then_pitch_then_roll(yaw_deg: float, pitch_deg: float, roll_deg: float) -> None:
    mount = CameraMount(name="a", width_px=64, height_px=32, yaw_deg=yaw_deg, pitch_deg=pitch_deg, roll_deg=roll_deg)
    ego_from_flu = Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True).as_matrix()
    assert np.allclose(mount.ego_from_camera.rotation, ego_from_flu @ CAMERA_FROM_ACTOR_AXES.T, atol=1e-9)
    assert mount.ego_from_camera.translation_m.tolist() == [1.5, 0.0, 1.65]


def test_a_mount_turns_to_the_left_down_and_to_the_right() -> None:
    def looks(**angles: float) -> tuple[np.ndarray, np.ndarray]:
        rotation = CameraMount(name="a", width_px=64, height_px=32, **angles).ego_from_camera.rotation
        return rotation @ [0, 0, 1], rotation @ [1, 0, 0]

    assert looks(yaw_deg=10)[0][1] > 0, "ahead is to the left"
    assert looks(pitch_deg=10)[0][2] < 0, "ahead is lower"
    assert looks(roll_deg=10)[1][2] < 0, "the picture's right is lower"


def test_the_field_of_view_is_that_of_the_pictures_width() -> None:
    assert CameraMount(name="a", width_px=64, height_px=32).intrinsics.focal_px == pytest.approx(32)
    assert CameraMount(name="a", width_px=64, height_px=32, hfov_deg=60).intrinsics.hfov_rad == pytest.approx(
        math.pi / 3
    )


def test_an_absurd_camera_is_refused() -> None:
    with pytest.raises(FieldError, match="16 to 8192"):
        CameraMount(name="left", width_px=4, height_px=32)
    with pytest.raises(FieldError, match="share a name"):
        Rig(cameras=(CameraMount(name="a", width_px=64, height_px=32),) * 2)
