from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.values.geometry import FrameMismatchError, Intrinsics, RigidTransform, wrap_angle_rad
from gear.values.scene import Pose

coordinate = st.floats(-500, 500, allow_nan=False)
angle = st.floats(-10, 10, allow_nan=False)


@st.composite
def transforms(draw: st.DrawFn) -> RigidTransform:
    q = np.array([draw(st.floats(-1, 1)) for _ in range(4)])
    q = q / np.linalg.norm(q) if np.linalg.norm(q) > 1e-3 else np.array([1.0, 0, 0, 0])
    pose = Pose(
        position_m=(draw(coordinate), draw(coordinate), draw(coordinate)),
        quat_wxyz=(float(q[0]), float(q[1]), float(q[2]), float(q[3])),
    )
    return pose.transform("world", "actor")


@given(transforms())
def test_a_transform_times_its_inverse_is_nothing(world_from_actor: RigidTransform) -> None:
    assert np.allclose((world_from_actor.inverse() @ world_from_actor).matrix, np.eye(4), atol=1e-9)
    assert np.isclose(np.linalg.det(world_from_actor.rotation), 1.0)


@given(transforms())
def test_a_pose_survives_its_rounding(world_from_actor: RigidTransform) -> None:
    again = Pose.from_transform(world_from_actor).transform("world", "actor")
    assert np.allclose(again.matrix, world_from_actor.matrix, atol=2e-6)
    assert Pose.from_transform(again) == Pose.from_transform(Pose.from_transform(again).transform("world", "actor"))


def test_chaining_asks_for_matching_frames() -> None:
    world_from_camera = RigidTransform("world", "camera", np.eye(4))
    with pytest.raises(FrameMismatchError, match="'camera' is not 'world'"):
        world_from_camera @ world_from_camera


def test_yaw_is_counter_clockwise_from_above() -> None:
    turned = RigidTransform.from_yaw("world", "actor", (1.0, 2.0, 0.0), math.radians(90))
    assert np.allclose(turned.apply([1.0, 0.0, 0.0]), [1.0, 3.0, 0.0])
    assert turned.yaw_rad == pytest.approx(math.pi / 2)


@given(st.floats(0, 1223), st.floats(0, 369), st.floats(0.5, 200))
def test_projecting_undoes_unprojecting(u: float, v: float, z: float) -> None:
    camera = Intrinsics.from_hfov(1224, 370, math.radians(90))
    assert np.allclose(camera.project(camera.unproject([u, v], z)), [u, v], atol=1e-6)


def test_a_symmetric_pinhole_has_its_axis_between_the_middle_pixels() -> None:
    camera = Intrinsics.from_hfov(1224, 370, math.radians(90))
    assert camera.focal_px == pytest.approx(612.0)
    assert (camera.cx_px, camera.cy_px) == (611.5, 184.5)
    assert np.allclose(camera.project([0.0, 0.0, 3.0]), [611.5, 184.5])


def test_the_projection_matrix_maps_the_fields_of_view_to_the_edges_of_the_picture() -> None:
    camera = Intrinsics(1224, 370, 500.0)
    x, y, w = camera.matrix @ [0.7, -0.4, 5.0]
    assert np.allclose([x / w, y / w], camera.project([0.7, -0.4, 5.0]))
    right, bottom = math.tan(camera.hfov_rad / 2), math.tan(camera.vfov_rad / 2)
    assert np.allclose(camera.project([right, bottom, 1.0]), [1223.5, 369.5])


@given(angle)
def test_wrapping_keeps_the_direction(angle_rad: float) -> None:
    wrapped = wrap_angle_rad(angle_rad)
    assert -math.pi <= wrapped < math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle_rad), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle_rad), abs=1e-9)
