"""Observations and actions of the driving environment as arrays, and their spaces."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from gear.contracts.controllers import Action, CarFacts, Obstacle
from gear.driving.simulation import Situation
from gear.envs.settings import DriveSettings
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Arrays = dict[str, npt.NDArray[Any]]

PATH_POINTS, PATH_STEP = 21, 2
"""Number of observed points of the lane, and their distance in metres."""

FAR = 1000.0
"""Bound of all observed numbers; larger ones are clipped."""

EGO = ("speed_mps", "acceleration_mps2", "steering_rad", "cruise_mps", "lateral_m", "lane_width_m")
"""The numbers of the observation `ego`, in order."""

OBSTACLE = (
    "is_there", "is_person", "ahead_m", "left_m", "yaw_rad", "half_length_m", "half_width_m", "ahead_mps", "left_mps",
)  # fmt: skip
"""The numbers of each row of the observation `obstacles`, in order, in the ego frame."""

ACTION_SPACE = gymnasium.spaces.Box(-1.0, 1.0, (2,), np.float32)
"""Pedals and steering: -1 is full braking and 1 full acceleration; -1 steers fully to the right and 1 to the left."""


def observation_space(settings: DriveSettings) -> gymnasium.spaces.Dict[Any]:
    """The space of observations: `ego` and `path`, and if `settings` ask for them `obstacles` and `camera`. `observed`
    describes the arrays.
    """
    spaces: dict[str, gymnasium.Space[Any]] = {
        "ego": gymnasium.spaces.Box(-FAR, FAR, (len(EGO),), np.float32),
        "path": gymnasium.spaces.Box(-FAR, FAR, (PATH_POINTS, 2), np.float32),
    }
    if settings.obstacles:
        spaces["obstacles"] = gymnasium.spaces.Box(-FAR, FAR, (settings.obstacles, len(OBSTACLE)), np.float32)
    if settings.has_camera:
        spaces["camera"] = gymnasium.spaces.Box(0, 255, (settings.height_px, settings.width_px, 3), np.uint8)
    return gymnasium.spaces.Dict(spaces)


def observed(situation: Situation, settings: DriveSettings, picture: UInt8Image | None) -> Arrays:
    """The observation of a situation as arrays.

    Args:
        situation: the state of the drive.
        settings: settings of the environment.
        picture: (H, W, 3) uint8 picture of the camera; None without a camera.

    Returns:
        Arrays by name: `ego`, the six numbers `EGO`; `path`, (N, 2) points of the lane ahead in the ego frame (x
        forward, y left, metres); `obstacles`, one row of the numbers `OBSTACLE` per road user, nearest first, then
        zeros; and `camera`, the picture.
    """
    ego, position = situation.ego, situation.position
    numbers = (
        ego.speed_mps, ego.acceleration_mps2, ego.steering_rad, situation.cruise_mps, position.lateral_m,
        position.lane_width_m,
    )  # fmt: skip
    arrays: Arrays = {
        "ego": _clipped(np.array(numbers)),
        "path": _clipped(situation.path_m[: PATH_POINTS * PATH_STEP : PATH_STEP]),
    }
    if settings.obstacles:
        nearest = sorted(situation.obstacles, key=lambda one: one.ahead_m**2 + one.left_m**2)
        rows = np.zeros((settings.obstacles, len(OBSTACLE)))
        for row, obstacle in zip(rows, nearest, strict=False):
            row[:] = _row(obstacle)
        arrays["obstacles"] = _clipped(rows)
    if picture is not None:
        arrays["camera"] = picture
    return arrays


def action_of(pedals_and_steering: npt.NDArray[Any], car: CarFacts) -> Action:
    """The action of a car from an element of `ACTION_SPACE`.

    Args:
        pedals_and_steering: (2,) numbers in -1..1, larger ones are clipped: pedals (1 full acceleration, -1 full
            braking) and steering (1 fully to the left).
        car: limits of the car, by which the numbers are scaled.

    Raises:
        GearError: a number is not finite.
    """
    if not np.isfinite(pedals_and_steering).all():
        raise GearError(f"environment: an action must be two finite numbers, got {pedals_and_steering!r}")
    pedals, steering = (float(value) for value in np.clip(pedals_and_steering, -1.0, 1.0))
    most_mps2 = car.most_acceleration_mps2 if pedals > 0 else car.most_braking_mps2
    return Action(acceleration_mps2=pedals * most_mps2, steering_rad=steering * car.most_steering_rad)


def _row(one: Obstacle) -> tuple[float, ...]:
    sizes = (one.half_length_m, one.half_width_m)
    return (1.0, float(one.kind == "person"), one.ahead_m, one.left_m, one.yaw_rad, *sizes, *one.velocity_mps)


def _clipped(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    return np.clip(values, -FAR, FAR).astype(np.float32)
