"""The pixels of the nearest obstacle in the ego lane, found from exact depth and the poses in the scene record.

Depth datasets store no ids. Every pixel is a point of the world, though, and the record has the pose of every vehicle
and person. The points in the ego car's corridor that are above the ground at a road user are pixels of an obstacle.

The corridor is straight: the strip ahead of the ego car, `LANE_WIDTH_M` wide and `MAX_AHEAD_M` long. Records do not
hold the lane, so in a bend the corridor leaves the lane on its outer side; the length limits that. Walls, boards and
poles are no road users and never count.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.camera.effects import recorded_effects
from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import ActorRecord, CameraRecord, SceneRecord

Indices = npt.NDArray[np.intp]

LANE_WIDTH_M = 3.5
"""Width of the corridor, that of a lane in CARLA's towns."""

MAX_AHEAD_M = 50.0
"""Length of the corridor from the middle of the ego car."""

HEIGHT_M = (0.2, 4.0)
"""Heights above the ground at an obstacle between which a point belongs to it, and not to the road or to the sky's side
of a bridge.
"""

MIN_PIXELS = 20
"""Smallest number of pixels of an obstacle in the corridor; fewer are the rim of an object beside the lane."""

LENGTH_TO_WIDTH = 2.5
"""Ratio by which a vehicle's points may be farther from its middle along its length than along its width."""

VEHICLE_REACH_M, PERSON_REACH_M = 2.8, 1.0
"""Largest distance of an obstacle's points from its middle, along the width of a vehicle, and of a person."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Obstacle:
    """The nearest obstacle in the corridor of one picture.

    Attributes:
        actor: its record.
        pixels: (H, W) bool, its pixels in the corridor.
        ahead_m: distance of its nearest pixel ahead of the middle of the ego car.
    """

    actor: ActorRecord
    pixels: npt.NDArray[np.bool_]
    ahead_m: float


def nearest_obstacle(record: SceneRecord, camera: str, depth_m: FloatImage) -> Obstacle | None:
    """Finds the nearest road user in the ego car's corridor, and its visible pixels there.

    Args:
        record: the scene.
        camera: name of the camera.
        depth_m: (H, W) exact depth along the camera's axis in metres; NaN where it is unknown.

    Returns:
        The obstacle; None if no road user has enough pixels in the corridor.
    """
    others = [actor for actor in record.actors if actor.role != "ego"]
    rows, columns = np.nonzero(np.nan_to_num(depth_m, nan=np.inf, posinf=np.inf) < 2 * MAX_AHEAD_M)
    points = _points(record.camera(camera), rows, columns, depth_m[rows, columns])
    ego = record.ego.world_from_actor.transform("world", "ego").inverse().apply(points)
    is_inside = (np.abs(ego[:, 1]) <= LANE_WIDTH_M / 2) & (ego[:, 0] > 0) & (ego[:, 0] <= MAX_AHEAD_M)
    rows, columns, points, ahead_m = rows[is_inside], columns[is_inside], points[is_inside], ego[is_inside, 0]
    if not others or not len(points):
        return None
    reach = np.stack([_reach(actor, points) for actor in others])
    owner = np.where(reach.min(axis=0) <= 1, reach.argmin(axis=0), -1)
    found = [(float(ahead_m[owner == n].min()), n) for n in range(len(others)) if (owner == n).sum() >= MIN_PIXELS]
    if not found:
        return None
    nearest_m, number = min(found)
    pixels = np.zeros(depth_m.shape, np.bool_)
    pixels[rows[owner == number], columns[owner == number]] = True
    return Obstacle(actor=others[number], pixels=pixels, ahead_m=nearest_m)


def _points(camera: CameraRecord, rows: Indices, columns: Indices, depth_m: FloatImage) -> Array:
    """(N, 3) points of the world that a camera sees at (N,) rows and columns, with (N,) depths in metres."""
    x, y = columns.astype(np.float64), rows.astype(np.float64)
    if moving := recorded_effects(camera):
        bent = moving[0].pixel_map(camera)  # each pixel of the distorted picture is elsewhere in the pinhole's picture
        x, y = bent.x[rows, columns].astype(np.float64), bent.y[rows, columns].astype(np.float64)
    seen = camera.intrinsics.unproject(np.stack([x, y], axis=1), depth_m)
    return camera.world_from_camera_transform.apply(seen)


def _reach(actor: ActorRecord, points: Array) -> Array:
    """(N,) distances of points from an actor's middle, of which 1 is the largest that may belong to it; infinite above
    or below it.
    """
    local = actor.world_from_actor.transform("world", "actor").inverse().apply(points)
    is_person = actor.role == "pedestrian"
    along, aside = (1.0, PERSON_REACH_M) if is_person else (LENGTH_TO_WIDTH, VEHICLE_REACH_M)
    distance = np.hypot(local[:, 0] / along, local[:, 1]) / aside
    low_m, high_m = HEIGHT_M
    return np.where((local[:, 2] >= low_m) & (local[:, 2] <= high_m), distance, np.inf)
