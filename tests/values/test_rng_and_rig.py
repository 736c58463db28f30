from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gear.values.errors import FieldError
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.rng import derive_rng


def test_each_purpose_has_its_own_generator_and_repeats_it() -> None:
    first = derive_rng(7, "scene", 12).random(4)
    assert np.array_equal(first, derive_rng(7, "scene", 12).random(4))
    for other in (
        derive_rng(7, "scene", 13),
        derive_rng(8, "scene", 12),
        derive_rng(7, "patch", 12),
        derive_rng(7, "scene", "12"),
    ):
        assert not np.array_equal(first, other.random(4))


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
