import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.groundtruth.boxes import Box3d, box_in_camera, project_box
from gear.groundtruth.silhouettes import clip_near
from gear.testing.synthetic import UNIT_FACES, synthetic_frame
from gear.testing.things import CAR, Thing
from gear.values.geometry import Intrinsics
from gear.values.rig import CameraMount, Rig

PINHOLE = Intrinsics(612, 185, 306.0)


def test_corners_stand_where_the_box_says() -> None:
    box = Box3d(height_m=1.5, width_m=1.8, length_m=4.2, bottom_m=(1.0, 1.65, 10.0), rotation_y_rad=-math.pi / 2)
    low, high = box.corners_m.min(axis=0), box.corners_m.max(axis=0)
    # Driving away: the length lies along z, the width along x, the height goes up from the bottom.
    np.testing.assert_allclose(low, [0.1, 0.15, 7.9], atol=1e-12)
    np.testing.assert_allclose(high, [1.9, 1.65, 12.1], atol=1e-12)
    assert box.distance_m == pytest.approx(math.sqrt(1 + 0.9**2 + 100))


def test_alpha_is_seen_along_the_ray() -> None:
    box = Box3d(height_m=1, width_m=1, length_m=1, bottom_m=(10.0, 1.0, 10.0), rotation_y_rad=0.0)
    assert box.alpha_rad == pytest.approx(-math.pi / 4)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
def test_the_box_is_the_objects_own(yaw_rad: float) -> None:
    rig = Rig(cameras=(CameraMount(name="left", width_px=612, height_px=185),))
    thing = Thing(parts=CAR, position_m=(12.0, 2.0, 0.0), yaw_rad=yaw_rad, object_id=2, role="npc")
    frame, record = synthetic_frame(rig, [thing])
    box = box_in_camera(frame.objects[2], record.camera("left"))
    assert (box.length_m, box.width_m, box.height_m) == pytest.approx((4.2, 1.8, 1.5))
    world = record.camera("left").world_from_camera_transform.apply(box.corners_m).round(6)
    own = frame.objects[2].world_from_object.apply(frame.objects[2].shape.vertices_m).round(6)
    np.testing.assert_allclose(world[np.lexsort(world.T)], own[np.lexsort(own.T)], atol=1e-6)


def test_projection_is_tight() -> None:
    box = Box3d(height_m=1.5, width_m=1.8, length_m=4.2, bottom_m=(1.0, 1.65, 10.0), rotation_y_rad=0.4)
    pixels = PINHOLE.project(box.corners_m)
    expected = (*pixels.min(axis=0), *pixels.max(axis=0))
    assert project_box(box.corners_m, PINHOLE) == pytest.approx(expected)


def test_boxes_through_the_camera_plane_are_cut_there() -> None:
    beside = Box3d(height_m=1.5, width_m=1.8, length_m=4.2, bottom_m=(-2.5, 1.65, 0.5), rotation_y_rad=-math.pi / 2)
    found = project_box(beside.corners_m, PINHOLE)
    assert found is not None
    # It stands on the left, so no part of it may turn up on the right.
    assert found[0] < -1000 and found[2] < PINHOLE.cx_px


def test_boxes_behind_are_nowhere() -> None:
    behind = Box3d(height_m=1.5, width_m=1.8, length_m=4.2, bottom_m=(0.0, 1.65, -8.0), rotation_y_rad=0.0)
    assert project_box(behind.corners_m, PINHOLE) is None


@given(
    st.floats(-4, 4),
    st.floats(-3, 3.5),
    st.floats(-math.pi, math.pi),
    st.sampled_from([(4.2, 1.8, 1.5), (0.6, 0.6, 1.8)]),
)
@settings(max_examples=100, deadline=None)
def test_boxes_cut_by_the_near_plane_are_what_is_left_of_their_faces(
    x_m: float, z_m: float, rotation_y_rad: float, size_m: tuple[float, float, float]
) -> None:
    length_m, width_m, height_m = size_m
    box = Box3d(
        height_m=height_m, width_m=width_m, length_m=length_m, bottom_m=(x_m, 1.65, z_m), rotation_y_rad=rotation_y_rad
    )
    left = clip_near(box.corners_m[UNIT_FACES]).reshape(-1, 3)
    found = project_box(box.corners_m, PINHOLE)
    if not len(left):
        assert found is None
        return
    pixels = PINHOLE.project(left)
    assert found == pytest.approx((*pixels.min(axis=0), *pixels.max(axis=0)), rel=1e-6, abs=1e-6)


def test_alpha_stays_within_half_a_turn() -> None:
    """-3 rad seen along a ray 0.79 rad to the right is a turn further round, 2.5 rad."""
    box = Box3d(height_m=1, width_m=1, length_m=1, bottom_m=(10.0, 1.0, 10.0), rotation_y_rad=-3.0)
    assert box.alpha_rad == pytest.approx(2 * math.pi - 3.0 - math.pi / 4)


def test_a_box_lies_about_its_own_centre_and_not_the_objects_origin() -> None:
    rig = Rig(cameras=(CameraMount(name="left", width_px=612, height_px=185),))
    thing = Thing(parts=CAR, position_m=(12.0, 2.0, 0.0), yaw_rad=0.8, object_id=2, role="npc")
    frame, record = synthetic_frame(rig, [thing])
    shape = replace(
        frame.objects[2].shape, box_centre_m=np.array([0.7, -0.3, 1.1]), box_size_m=np.array([3.0, 1.2, 1.6])
    )
    camera = record.camera("left")
    box = box_in_camera(replace(frame.objects[2], shape=shape), camera)
    assert (box.length_m, box.width_m, box.height_m) == (3.0, 1.2, 1.6)
    world_from_object = frame.objects[2].world_from_object
    own = np.array([[0.7 + dx, -0.3 + dy, z] for dx in (-1.5, 1.5) for dy in (-0.6, 0.6) for z in (0.3, 1.9)])
    expected, found = world_from_object.apply(own), camera.world_from_camera_transform.apply(box.corners_m)
    assert {tuple(corner) for corner in found.round(6) + 0.0} == {tuple(corner) for corner in expected.round(6) + 0.0}
    front = camera.world_from_camera_transform.inverse().rotation @ world_from_object.rotation[:, 0]
    c, s = math.cos(box.rotation_y_rad), math.sin(box.rotation_y_rad)
    np.testing.assert_allclose(front, [c, 0.0, -s], atol=1e-9)
