"""The protocol of controllers: in the closed loop of `gear drive`, a controller turns what a network predicts into
acceleration and steering.

The ego frame is x forward, y left, z up, with the origin on the ground in the middle of the car's footprint.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image
from gear.values.rig import CameraMount

Points = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class CarFacts:
    """Sizes and limits of the ego car, which a controller knows.

    Attributes:
        wheelbase_m: distance between the axles; they lie half of it before and behind the middle of the car.
        front_m, rear_m, half_width_m: distances of the front, the rear and the sides from the middle of the footprint.
        most_acceleration_mps2, most_braking_mps2: largest acceleration and largest deceleration, both positive.
        most_steering_rad: largest steering angle of the front wheels to either side.
    """

    wheelbase_m: float
    front_m: float
    rear_m: float
    half_width_m: float
    most_acceleration_mps2: float
    most_braking_mps2: float
    most_steering_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoState:
    """The motion of the ego car.

    Attributes:
        speed_mps: speed, never negative.
        acceleration_mps2: longitudinal acceleration; negative while braking.
        steering_rad: steering angle of the front wheels, positive to the left.
    """

    speed_mps: float
    acceleration_mps2: float = 0.0
    steering_rad: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """The true position and motion of another road user, in the ego frame.

    Attributes:
        id: id of the actor in the scene record.
        kind: whether it is a vehicle or a person.
        ahead_m, left_m: middle of its footprint.
        yaw_rad: its heading, counter-clockwise from the ego car's heading.
        half_length_m, half_width_m: half of the sides of its footprint.
        velocity_mps: its velocity over ground, along the ego frame's x and y axes.
    """

    id: int
    kind: Literal["vehicle", "person"]
    ahead_m: float
    left_m: float
    yaw_rad: float
    half_length_m: float
    half_width_m: float
    velocity_mps: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Observation:
    """What a controller receives in one frame.

    Attributes:
        time_s: time since the start of the drive.
        ego: motion of the ego car.
        car: sizes and limits of the ego car.
        cruise_mps: speed that the car should have on a free road.
        path_m: (N, 2) points on the centre line of the known lane, in the ego frame, 1 m apart; the first point is the
            one next to the middle of the car.
        lane_width_m: width of the lane.
        cameras: cameras of the rig with their intrinsics and poses on the car; the first is the reference camera.
        prediction: prediction of the network in the format of its task; None for controllers without a network.
        views: (H, W, 3) uint8 pictures by camera name, before any defense; empty unless the spec says `needs_views`.
        obstacles: the true positions of all other road users; empty unless the spec says `needs_truth`.
        red_light_m: true distance from the front of the car to the stop line of the red traffic light ahead; None
            without one, and unless the spec says `needs_truth`.
    """

    time_s: float
    ego: EgoState
    car: CarFacts
    cruise_mps: float
    path_m: Points
    lane_width_m: float
    cameras: tuple[CameraMount, ...] = ()
    prediction: Any = None
    views: Mapping[str, UInt8Image] = field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()
    red_light_m: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """What a controller wants the car to do until the next frame. Values beyond the car's limits are clipped.

    Attributes:
        acceleration_mps2: longitudinal acceleration; negative for braking.
        steering_rad: steering angle of the front wheels, positive to the left.
        notes: numbers about the controller's state, by name, for the log and the video, such as the distance to the
            obstacle that it follows.
    """

    acceleration_mps2: float
    steering_rad: float
    notes: Mapping[str, float] = field(default_factory=dict)


class Controller(Protocol):
    """Drives the ego car. It may remember earlier frames of the same drive, but nothing of an earlier drive."""

    def reset(self, seed: int) -> None:
        """Forgets everything, at the start of a drive.

        Args:
            seed: seed of all random choices of the drive.
        """
        ...

    def act(self, observation: Observation) -> Action:
        """Decides acceleration and steering from one frame. The observation must not be changed.

        Args:
            observation: what the controller receives in this frame.
        """
        ...
