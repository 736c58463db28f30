"""The nearest obstacle in the ego lane, against the ids of the renderer and rays that are computed here."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from gear.camera.effects.lens import Lens
from gear.metrics.obstacle_pixels import nearest_obstacle
from gear.plugins.tasks.depth import DepthConfig, DepthTask
from gear.testing.synthetic import behind_lens, synthetic_frame
from gear.testing.things import CAR, PERSON, TRUCK, Thing, board, box_part, street
from gear.values.frames import Frame
from gear.values.geometry import RigidTransform
from gear.values.rig import Rig
from gear.values.scene import Role, SceneRecord

AWAY = RigidTransform.from_yaw("world", "ego", (37.0, -12.0, 2.5), 0.8)


def rig(width_px: int = 304, height_px: int = 152) -> Rig:
    return DepthTask(DepthConfig(width_px=width_px, height_px=height_px)).rig()


def thing(parts: tuple, ahead_m: float, left_m: float, number: int, role: Role = "npc", yaw_rad: float = 0.0) -> Thing:
    return Thing(parts=parts, position_m=(ahead_m, left_m, 0.0), yaw_rad=yaw_rad, object_id=number, role=role)


def by_ids(frame: Frame, record: SceneRecord) -> tuple[int, npt.NDArray[np.bool_]] | None:
    """The same by ids and trigonometry in the plane, with pinhole cameras on a flat road."""
    view = frame.views["left"]
    camera, ego = view.camera, record.ego.world_from_actor
    pose = camera.world_from_camera_transform
    yaw = 2 * math.atan2(ego.quat_wxyz[3], ego.quat_wxyz[0])
    ids = np.where(view.geom_id >= 0, frame.geoms.object_id[np.maximum(view.geom_id, 0)], -1)
    known = {actor.id for actor in record.actors if actor.role != "ego"}
    pixels: dict[int, list[tuple[int, int, float]]] = {}
    for row, column in zip(*np.nonzero(np.isin(ids, list(known))), strict=True):
        depth = float(view.depth_m[row, column])
        ray = (
            (column - (camera.width_px - 1) / 2) / camera.focal_px * depth,
            (row - (camera.height_px - 1) / 2) / camera.focal_px * depth,
            depth,
        )
        east, north, up = pose.rotation @ np.array(ray) + pose.translation_m - np.array(ego.position_m)
        ahead, left = east * math.cos(yaw) + north * math.sin(yaw), north * math.cos(yaw) - east * math.sin(yaw)
        if abs(left) <= 1.75 and 0 < ahead <= 50 and 0.2 <= up <= 4:
            pixels.setdefault(int(ids[row, column]), []).append((row, column, ahead))
    distances = {number: min(p[2] for p in found) for number, found in pixels.items() if len(found) >= 20}
    if not distances:
        return None
    number = min(distances, key=lambda one: distances[one])
    mask = np.zeros(view.depth_m.shape, np.bool_)
    for row, column, _ in pixels[number]:
        mask[row, column] = True
    return number, mask


@pytest.mark.parametrize("pose", [None, AWAY])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_that_of_the_ids(seed: int, pose: RigidTransform | None) -> None:
    frame, record = synthetic_frame(rig(), street(seed), seed=seed, world_from_ego=pose)
    wanted = by_ids(frame, record)
    found = nearest_obstacle(record, "left", frame.views["left"].depth_m)
    assert wanted is not None and found is not None
    assert found.actor.id == wanted[0]
    assert (found.pixels & wanted[1]).sum() / (found.pixels | wanted[1]).sum() > 0.97


@pytest.mark.parametrize(
    ("things", "wanted", "ahead_m"),
    [
        ([thing(CAR, 20, 0, 2), thing(CAR, 12, 3.5, 3)], 2, 17.9),  # the nearer one is in the next lane
        ([thing(CAR, 20, 0, 2), thing(PERSON, 12, 1, 3, "pedestrian")], 3, 11.75),
        ([thing(CAR, 30, 0, 2, yaw_rad=math.pi / 2), thing(CAR, 60, 0, 3)], 2, 29.1),  # across the lane
        ([thing(TRUCK, 30, 0, 2, "carrier")], 2, 26.0),
        ([thing(CAR, 20, 2.5, 2, "parked")], 2, 17.9),  # reaches into the lane by 15 cm
    ],
)
def test_the_nearest_one_in_the_lane_is_taken(things: list[Thing], wanted: int, ahead_m: float) -> None:
    frame, record = synthetic_frame(rig(608, 304), things)
    found = nearest_obstacle(record, "left", frame.views["left"].depth_m)
    assert found is not None and found.actor.id == wanted
    assert found.ahead_m == pytest.approx(ahead_m, abs=0.02)


@pytest.mark.parametrize(
    "things",
    [
        [],
        [thing(CAR, 20, 3.5, 2)],
        [thing(CAR, 56, 0, 2)],  # beyond the corridor
        [board(15.0)],  # no road user
        [Thing(parts=(box_part("building", 2.0, 60.0, 14.0),), position_m=(30.0, 0.0, 0.0))],
        [thing(CAR, 30, 0, 2), board(20.0)],  # hidden by a board
    ],
)
def test_a_free_lane_has_none(things: list[Thing]) -> None:
    frame, record = synthetic_frame(rig(), things)
    assert nearest_obstacle(record, "left", frame.views["left"].depth_m) is None


def test_a_lens_moves_the_pixels_and_not_the_obstacle() -> None:
    frame, record = synthetic_frame(rig(608, 304), [thing(CAR, 12, 0.8, 2), thing(CAR, 25, -0.5, 3)])
    bent = behind_lens(frame, Lens(k1=-0.25, k2=0.05))
    record = replace(record, cameras=tuple(view.camera for view in bent.views.values()))
    found = nearest_obstacle(record, "left", bent.views["left"].depth_m)
    assert found is not None and found.actor.id == 2
    assert found.ahead_m == pytest.approx(9.9, abs=0.05)
    ids = frame.geoms.object_id[np.maximum(bent.views["left"].geom_id, 0)]
    assert (ids[found.pixels] == 2).all()


def test_unknown_depth_is_no_obstacle() -> None:
    frame, record = synthetic_frame(rig(), [thing(CAR, 20, 0, 2)])
    depth_m = frame.views["left"].depth_m
    for value in (np.nan, np.inf):
        assert nearest_obstacle(record, "left", np.full_like(depth_m, value)) is None
    holes = np.where(np.arange(depth_m.shape[1]) % 2, np.float32(np.nan), depth_m)
    found = nearest_obstacle(record, "left", holes)
    assert found is not None and not found.pixels[:, 1::2].any()
