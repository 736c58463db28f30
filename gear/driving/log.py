"""The log of a drive: one line of canonical JSON per frame. Equal drives have equal bytes, and so an equal hash."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gear.contracts.controllers import Action, Observation, Points
from gear.driving.simulation import Situation
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.truth import outline
from gear.values.serial import Json

DIGITS = 6
"""Number of decimals of all numbers in a log."""

HAZARD_MARGIN_M = 0.5
"""A road user is a hazard if it is at most this far outside the lane, metres: it may come into the lane."""

HAZARD_S = 5.0
"""A road user is a hazard if the ego car would reach it within this time, seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Danger:
    """What is in front of the ego car in truth.

    Attributes:
        gap_m: free distance to the nearest road user in the corridor (the strip that the car will drive through); None
            for a free corridor.
        ttc_s: time in seconds until the car would touch that road user; None if it is not approached.
        least_m: distance between the footprints of the ego car and of the nearest road user; None without road users.
        is_hazard: whether a road user is in the lane or near it, or a red light ahead, so that braking is no phantom
            braking.
    """

    gap_m: float | None
    ttc_s: float | None
    least_m: float | None
    is_hazard: bool


def danger_of(situation: Situation, scripted: int | None) -> Danger:
    """Measures the danger in one frame, from the true positions of all road users.

    Args:
        situation: the state of the drive.
        scripted: id of the scripted road user, which is a hazard wherever it is in front of the car; None without one.
    """
    observation = situation.observation(with_truth=True)
    corridor = Corridor.of(observation)
    reach_m = observation.ego.speed_mps * HAZARD_S + 10.0
    gaps: list[tuple[float, float]] = []
    distances: list[float] = []
    is_hazard = situation.red_light_m is not None and situation.red_light_m < reach_m
    for obstacle in observation.obstacles:
        outline_m = outline(obstacle)
        distances.append(_distance_m(outline_m, observation))
        if obstacle.ahead_m < -20.0 or obstacle.ahead_m > 90.0:
            continue
        arc_m, left_m = corridor.along(outline_m)
        gap_m = corridor.gap_m(outline_m, corridor.length_m)
        if gap_m is not None:
            direction = corridor.directions(np.array([float(arc_m.min())]))[0]
            closing_mps = observation.ego.speed_mps - float(direction @ np.array(obstacle.velocity_mps))
            gaps.append((gap_m, closing_mps))
        is_ahead = float(arc_m.max()) > corridor.front_m and float(arc_m.min()) < corridor.front_m + reach_m
        edge_m = observation.lane_width_m / 2 + HAZARD_MARGIN_M
        is_near = float(left_m.min()) < edge_m and float(left_m.max()) > -edge_m
        is_hazard = is_hazard or (is_ahead and (is_near or obstacle.id == scripted))
    gap, closing = min(gaps, default=(None, 0.0))
    return Danger(
        gap_m=gap,
        ttc_s=gap / closing if gap is not None and closing > 0.1 else None,
        least_m=min(distances, default=None),
        is_hazard=is_hazard,
    )


def _distance_m(outline_m: Points, observation: Observation) -> float:
    """Distance between the ego car's footprint and another footprint, (8, 2) points in the ego frame; 0 for contact.

    Two rectangles that do not overlap are nearest at a corner of one of them.
    """
    car = observation.car
    middle_m, half = (car.front_m - car.rear_m) / 2, np.array([(car.front_m + car.rear_m) / 2, car.half_width_m])
    own = np.array([(middle_m + sx * half[0], sy * half[1]) for sx in (1, -1) for sy in (1, -1)])
    outside = np.maximum(np.abs(outline_m - np.array([middle_m, 0.0])) - half, 0.0)
    forward, side = outline_m[0] - outline_m[6], outline_m[0] - outline_m[2]
    length_m, width_m = float(np.linalg.norm(forward)), float(np.linalg.norm(side))
    axes = np.stack([forward / max(length_m, 1e-9), side / max(width_m, 1e-9)])
    local = (own - outline_m.mean(axis=0)) @ axes.T
    other = np.maximum(np.abs(local) - np.array([length_m / 2, width_m / 2]), 0.0)
    return float(min(np.linalg.norm(outside, axis=1).min(), np.linalg.norm(other, axis=1).min()))


def frame_entry(
    situation: Situation, danger: Danger, action: Action | None, ids: Mapping[str, int], *, with_tilt: bool = False
) -> Json:
    """The log entry of one frame.

    Args:
        situation: the state at the time of the frame.
        danger: what is in front of the car.
        action: the controller's decision; None in the last frame.
        ids: ids of the road users by body.
        with_tilt: whether the entry has the pitch and the roll of the ego car.

    Returns:
        Motion of the ego car (`ego` is x, y, z and yaw), its position on the route, the danger, and `actors` (id, x, y,
        yaw and speed of each other road user); with a decision also `command` (acceleration, steering angle) and
        `notes`; in a scenario with a red light also `red_light_m` (distance to the stop line, null beyond it) and
        `ran_red_light`; with `with_tilt` also `tilt` (pitch, positive with the nose down, and roll, positive to the
        right). Metres, seconds, radians.
    """
    ego, position = situation.ego, situation.position
    entry: dict[str, Any] = {
        "frame": situation.frame,
        "time_s": situation.time_s,
        "ego": [ego.x_m, ego.y_m, float(situation.world_from_ego.translation_m[2]), ego.yaw_rad],
        "speed_mps": ego.speed_mps,
        "acceleration_mps2": ego.acceleration_mps2,
        "steering_rad": ego.steering_rad,
        "s_m": position.s_m,
        "lateral_m": position.lateral_m,
        "lane_width_m": position.lane_width_m,
        "gap_m": danger.gap_m,
        "ttc_s": danger.ttc_s,
        "least_m": danger.least_m,
        "is_hazard": danger.is_hazard,
        "actors": [
            [ids[body], spawn.x_m, spawn.y_m, spawn.yaw_rad, spawn.speed_mps]
            for body, spawn in situation.spawns.items()
        ],
    }
    if situation.red_light_m is not None or situation.ran_red_light:
        entry |= {"red_light_m": situation.red_light_m, "ran_red_light": situation.ran_red_light}
    if with_tilt:
        rotation = situation.world_from_ego.rotation
        entry["tilt"] = [math.asin(-float(rotation[2, 0])), math.atan2(float(rotation[2, 1]), float(rotation[2, 2]))]
    if action is not None:
        entry["command"] = [action.acceleration_mps2, action.steering_rad]
        entry["notes"] = dict(sorted(action.notes.items()))
    return entry


def log_bytes(entries: Sequence[Json]) -> bytes:
    """The entries as lines of canonical JSON: sorted keys, no blanks, numbers rounded to `DIGITS` decimals."""
    lines = [
        json.dumps(_rounded(entry), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        for entry in entries
    ]
    return "".join(f"{line}\n" for line in lines).encode()


def log_hash(data: bytes) -> str:
    """The SHA-256 of the bytes of a log (`log_bytes`), as 64 hexadecimal digits; equal for equal drives."""
    return hashlib.sha256(data).hexdigest()


def _rounded(value: Json) -> Json:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return round(float(value), DIGITS) + 0.0 if math.isfinite(value) else None
    return value
