"""Optical flow against closed forms, ray casts and pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from gear.camera.effects import Lens
from gear.camera.effects.lens import LensDistortion
from gear.groundtruth.optical_flow import Flow, FlowView, object_ids, optical_flow
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, PERSON, Thing, box_part
from gear.values.frames import Frame
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import SceneRecord

MOUNT = CameraMount(name="left", width_px=160, height_px=96, hfov_deg=80.0)
PINHOLE, HEIGHT_M = MOUNT.intrinsics, MOUNT.position_m[2]
WALL = Thing(parts=(box_part("building", 2.0, 30.0, 9.0),), position_m=(40.0, 3.0, 0.0))
Floats = npt.NDArray[np.float64]
Seen = tuple[Frame, SceneRecord]


def ego_at(x_m: float = 0.0, y_m: float = 0.0, yaw_deg: float = 0.0) -> RigidTransform:
    return RigidTransform.from_yaw("world", "ego", (x_m, y_m, 0.0), math.radians(yaw_deg))


def seen(ego: RigidTransform, things: Sequence[Thing] = (), mount: CameraMount = MOUNT) -> Seen:
    """A frame of things that stand at positions in the world."""
    relative = []
    for thing in things:
        x, y, z = ego.inverse().apply(thing.position_m)
        relative.append(replace(thing, position_m=(float(x), float(y), float(z)), yaw_rad=thing.yaw_rad - ego.yaw_rad))
    return synthetic_frame(Rig(cameras=(mount,)), relative, world_from_ego=ego)


def flow_of(before: Seen, after: Seen) -> Flow:
    def view(one: Seen) -> FlowView:
        shown = one[0].views["left"]
        return FlowView(
            camera=shown.camera,
            depth_m=shown.depth_m,
            object_id=object_ids(shown.geom_id, one[0].geoms.object_id),
        )

    return optical_flow(view(before), view(after), before[1], after[1])


def grid() -> tuple[Floats, Floats]:
    """Columns and rows of all pixels, from the principal point."""
    row, column = np.mgrid[:96, :160].astype(np.float64)
    return column - PINHOLE.cx_px, row - PINHOLE.cy_px


def moved(thing: Thing, x_m: float, y_m: float, turn_deg: float = 0.0) -> Thing:
    x, y, z = thing.position_m
    return replace(thing, position_m=(x + x_m, y + y_m, z), yaw_rad=thing.yaw_rad + math.radians(turn_deg))


def test_on_a_straight_road_the_ground_flows_out_of_the_middle() -> None:
    ahead_m = 0.8
    flow = flow_of(seen(ego_at()), seen(ego_at(ahead_m)))
    x, y = grid()
    is_ground = y > 4
    with np.errstate(divide="ignore"):
        depth_m = PINHOLE.fy_px * HEIGHT_M / y
    factor = depth_m / (depth_m - ahead_m) - 1
    expected = np.stack([x * factor, y * factor], axis=-1)
    assert flow.flow_px[is_ground] == pytest.approx(expected[is_ground], rel=1e-4, abs=1e-3)
    is_sky = y < -1
    assert np.abs(flow.flow_px[is_sky]).max() < 1e-4, "the sky does not move when the camera does not turn"
    end_x, end_y = x + flow.flow_px[..., 0], y + flow.flow_px[..., 1]
    is_near = is_ground & (depth_m < 30)
    assert flow.is_visible[is_near & (np.abs(end_x) < 79.9) & (end_y < 47.9)].all()
    assert not flow.is_visible[is_near & ((np.abs(end_x) > 80.1) | (end_y > 48.1))].any()


def test_a_turn_on_the_spot_moves_everything_by_one_homography() -> None:
    """Turned to the left by a, the direction (x, y, f) becomes (x cos a + f sin a, y, f cos a - x sin a)."""
    turn_deg = 3.0
    still = replace(MOUNT, position_m=(0.0, 0.0, HEIGHT_M))  # it turns about the camera
    flow = flow_of(seen(ego_at(), [WALL], still), seen(ego_at(yaw_deg=turn_deg), [WALL], still))
    x, y = grid()
    c, s, f = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg)), PINHOLE.fx_px
    z = (f * c - x * s) / f
    expected = np.stack([(x * c + f * s) / z - x, y / z - y], axis=-1)
    assert flow.flow_px == pytest.approx(expected, rel=1e-4, abs=2e-3), "sky, wall and ground"
    assert flow.flow_px[48, 80, 0] > 0, "pictures flow to the right in a turn to the left"


def test_a_car_that_keeps_its_distance_stands_still_in_the_picture() -> None:
    car = Thing(parts=CAR, position_m=(12.0, -2.0, 0.0), object_id=5, role="npc")
    before, after = seen(ego_at(), [WALL, car]), seen(ego_at(0.7), [WALL, moved(car, 0.7, 0.0)])
    flow = flow_of(before, after)
    is_car = object_ids(before[0].views["left"].geom_id, before[0].geoms.object_id) == 5
    assert is_car.sum() > 100 and np.abs(flow.flow_px[is_car]).max() < 1e-3
    assert flow.is_visible[is_car].all()
    assert np.array_equal(flow.actor_id, np.where(is_car, 5, 0)), "the ego car and the wall are no other road users"


def test_corners_of_a_turning_car_are_where_the_flow_leads() -> None:
    car = Thing(parts=CAR, position_m=(9.0, -1.5, 0.0), yaw_rad=0.4, object_id=5, role="npc")
    later = moved(car, 0.5, 0.3, 6.0)
    before, after = seen(ego_at(), [car]), seen(ego_at(0.9, 0.1, 1.0), [later])
    flow = flow_of(before, after)
    is_car = object_ids(before[0].views["left"].geom_id, before[0].geoms.object_id) == 5
    corners_m = [(x, y, z) for x in (-2.1, 2.1) for y in (-0.9, 0.9) for z in (0.0, 1.5)]
    places = []
    for thing, (frame, _) in ((car, before), (later, after)):
        camera = frame.views["left"].camera
        world_m = thing.world_from_thing.apply(corners_m)
        places.append(PINHOLE.project(camera.world_from_camera_transform.inverse().apply(world_m)))
    rows, columns = np.nonzero(is_car)
    checked = 0
    for start, end in zip(*places, strict=True):
        distances = np.hypot(columns - start[0], rows - start[1])
        if distances.min() < 1.0:  # a corner that the picture shows
            nearest = distances.argmin()
            found = flow.flow_px[rows[nearest], columns[nearest]]
            if np.abs(found - (end - start)).max() < 0.35:
                checked += 1
    assert checked >= 5, "of at most seven corners that can be seen; some of them lie behind the car's edges"


def depth_along(rays: Floats, camera_m: Floats, things: Sequence[Thing]) -> Floats:
    """The depth at which rays of depth 1 meet the ground or the first box, by slabs."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = np.where(rays[:, 2] < 0, -camera_m[2] / rays[:, 2], np.inf)
        for thing in things:
            to_thing = thing.world_from_thing.inverse()
            for part in thing.parts:
                origin, along = to_thing.apply(camera_m) - part.centre_m, rays @ to_thing.rotation.T
                slabs = np.stack([(side * np.array(part.size_m) / 2 - origin) / along for side in (-1, 1)])
                enter, leave = slabs.min(axis=0).max(axis=1), slabs.max(axis=0).min(axis=1)
                found = np.where((enter < leave) & (enter > 0), np.minimum(found, enter), found)
    return np.asarray(found)


def test_visibility_agrees_with_rays_to_the_points() -> None:
    car = Thing(parts=CAR, position_m=(10.0, -2.2, 0.0), yaw_rad=0.3, object_id=5, role="npc")
    person = Thing(parts=PERSON, position_m=(7.0, 1.0, 0.0), object_id=6, role="pedestrian")
    later = [WALL, moved(car, 0.2, 0.9, 4.0), moved(person, 0.0, -0.6)]
    before, after = seen(ego_at(), [WALL, car, person]), seen(ego_at(1.0, 0.0, 1.5), later)
    flow = flow_of(before, after)
    x, y = grid()
    shown = before[0].views["left"]
    camera = after[0].views["left"].camera
    world_from_camera = camera.world_from_camera_transform
    ends = np.stack([x + PINHOLE.cx_px, y + PINHOLE.cy_px], axis=-1) + flow.flow_px
    is_inside = ((ends > -0.5) & (ends < (159.5, 95.5))).all(axis=-1) & np.isfinite(shown.depth_m)
    rays = PINHOLE.unproject(ends[is_inside], np.ones(is_inside.sum())) @ world_from_camera.rotation.T
    first_m = depth_along(rays, world_from_camera.translation_m, later)
    points_m = shown.camera.world_from_camera_transform.apply(
        PINHOLE.unproject(np.stack([x + PINHOLE.cx_px, y + PINHOLE.cy_px], axis=-1), shown.depth_m)
    )
    ids = object_ids(shown.geom_id, before[0].geoms.object_id)
    for number, (old, new) in {5: (car, later[1]), 6: (person, later[2])}.items():
        points_m[ids == number] = new.world_from_thing.apply(
            old.world_from_thing.inverse().apply(points_m[ids == number])
        )
    point_depth_m = world_from_camera.inverse().apply(points_m)[..., 2][is_inside]
    is_free = first_m > point_depth_m * (1 - 1e-4)
    assert 100 < (~is_free).sum() < is_free.sum(), "some points are hidden"
    said = flow.is_visible[is_inside]
    assert (said & ~is_free).sum() == 0, "no hidden point is called visible"
    assert (is_free & ~said).sum() < 0.08 * is_free.sum(), "edges count as hidden, and are many in a small picture"


def test_the_next_picture_pulled_back_by_the_flow_is_the_picture() -> None:
    large = replace(MOUNT, width_px=640, height_px=384)
    wall = replace(WALL, position_m=(9.3, 3.0, 0.0))
    before, after = seen(ego_at(), [wall], large), seen(ego_at(0.6, 0.0, 2.0), [wall], large)
    flow = flow_of(before, after)
    row, column = np.mgrid[:384, :640].astype(np.float32)
    shown = before[0].views["left"]
    is_wall = flow.is_visible & (shown.geom_id == 1)
    assert is_wall.sum() > 60_000

    def equal(flow_px: npt.NDArray[np.float32]) -> float:
        x, y = column + flow_px[..., 0], row + flow_px[..., 1]
        pulled = cv2.remap(after[0].views["left"].rgb, x, y, cv2.INTER_NEAREST)
        return float((pulled == shown.rgb).all(axis=-1)[is_wall].mean())

    assert equal(flow.flow_px) > 0.95, "but for the edges of the painted squares"
    assert equal(flow.flow_px + np.float32(3.0)) < 0.9 and equal(np.zeros_like(flow.flow_px)) < 0.7


def test_an_actor_without_a_next_pose_has_no_flow() -> None:
    car = Thing(parts=CAR, position_m=(12.0, -2.0, 0.0), object_id=5, role="npc")
    before, after = seen(ego_at(), [car]), seen(ego_at(0.7))
    flow = flow_of(before, after)
    is_car = object_ids(before[0].views["left"].geom_id, before[0].geoms.object_id) == 5
    assert np.isnan(flow.flow_px[is_car]).all() and not flow.is_visible[is_car].any()
    assert np.isfinite(flow.flow_px[~is_car]).all()


def test_a_lens_bends_the_flow() -> None:
    effect = LensDistortion(lens=Lens(k1=-0.2, k2=0.03))

    def behind(one: Seen) -> Seen:
        frame, record = one
        camera = effect.recorded(record.cameras[0])
        return (
            replace(frame, views={"left": replace(frame.views["left"], camera=camera)}),
            replace(record, cameras=(camera,)),
        )

    before, after = seen(ego_at(), [WALL]), seen(ego_at(0.6, 0.0, 2.0), [WALL])
    plain = flow_of(before, after)
    bent = flow_of(behind(before), behind(after))
    lens = effect.pixel_map(behind(before)[1].cameras[0])
    column, row = np.rint(lens.x).astype(int), np.rint(lens.y).astype(int)
    start = np.stack([column, row], axis=-1).astype(np.float64)
    end = start + plain.flow_px[row, column]
    assert bent.flow_px == pytest.approx(lens.forward(end) - lens.forward(start), abs=1e-3)
    assert np.abs(bent.flow_px - plain.flow_px).max() > 1.0
    still = flow_of(behind(before), behind(before))
    assert np.abs(still.flow_px).max() < 1e-4 and still.is_visible.mean() > 0.95
