"""The common part of the baseline controllers: cruise control, emergency braking and steering along the known lane.

Every baseline is the same driver with another reader of obstacles: a reader finds the nearest obstacle in the corridor
in what the network predicts. No part of it was tuned to a patch. Speed follows the intelligent driver model (Treiber,
Hennecke and Helbing, Physical Review E 2000), with the deceleration of adaptive cruise control (ISO 15622); below a
time to collision of 1.6 s the car brakes as hard as it can. Steering is pure pursuit (Coulter, CMU-RI-TR-92-01).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Action, Observation
from gear.plugins.controllers.corridor import Corridor
from gear.plugins.controllers.tracker import Sighting, Tracker
from gear.values.errors import FieldError

ACCELERATION_MPS2, COMFORTABLE_MPS2, CRUISE_BRAKING_MPS2 = 1.6, 2.0, 3.5
STANDSTILL_GAP_M, HEADWAY_S = 4.0, 1.2
"""Gap behind a standing obstacle, and time gap behind a moving one. The gap is at the upper end of what adaptive cruise
control keeps, because networks see little nearer than 5 m in their training pictures, and take nearer things for that
far.
"""
RELEASE_GAP_M = 1.0
"""Emergency braking ends when the obstacle is no longer approached and is farther away than this, or the car stands."""

HOLD_MPS, HOLD_GAP_M = 1.5, 6.0
"""A car at walking pace behind an obstacle that stands, or nearly stands, stops and stays there (stop and hold): both
are slower than this speed, and the gap is below this distance. Otherwise errors of the measured gap let it creep on.
"""

LEAST_LOOK_AHEAD_M, LOOK_AHEAD_S = 5.0, 0.8
"""Pure pursuit aims at the point of the path that the car reaches after this time, but at least at this distance."""

CLOSING_MPS = 0.1
"""Closing speed below which an obstacle counts as not approached, m/s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineConfig:
    """Options of all baseline controllers.

    Attributes:
        emergency_ttc_s: time to collision below which the car brakes as hard as it can, 0 to 5 s.
    """

    emergency_ttc_s: float = 1.6

    def __post_init__(self) -> None:
        if not 0 <= self.emergency_ttc_s <= 5:
            raise FieldError("emergency_ttc_s", f"must be 0 to 5 s, got {self.emergency_ttc_s:g}")


class Baseline(ABC):
    """A driver that keeps to the lane and brakes for the nearest obstacle that its reader (`nearest`) finds.

    Args:
        config: options of the driver.
    """

    def __init__(self, config: BaselineConfig) -> None:
        self._emergency_ttc_s = config.emergency_ttc_s
        self.reset(0)

    @abstractmethod
    def nearest(self, observation: Observation, corridor: Corridor) -> Sighting | None:
        """Returns the nearest obstacle in the corridor that this frame shows; None for a free corridor.

        Args:
            observation: what the driver knows in this frame: speed, lane, cameras and the network's prediction.
            corridor: the strip of road that the car needs, in the ego frame.
        """

    def reset(self, seed: int) -> None:
        """Forgets the obstacles of an earlier drive.

        Args:
            seed: not used, because these controllers draw no random numbers.
        """
        self._tracker = Tracker()
        self._is_braking = False

    def act(self, observation: Observation) -> Action:
        """Chooses the acceleration from the nearest obstacle and the cruising speed, and the steering from the
        known lane.

        Args:
            observation: what the driver knows in this frame.

        Returns:
            The action. Its notes say whether the emergency brake acts (`is_emergency`, 0 or 1), and, where known, the
            gap in this frame (`seen_gap_m`), the tracked gap (`gap_m`) and the obstacle's speed (`leader_mps`).
        """
        corridor = Corridor.of(observation)
        sighting = self.nearest(observation, corridor)
        speed_mps = observation.ego.speed_mps
        track = self._tracker.update(sighting, observation.time_s, speed_mps)
        notes = {"is_emergency": 0.0}
        if sighting is not None:
            notes["seen_gap_m"] = sighting.gap_m
        gap_m, leader_mps = math.inf, 0.0
        if track is not None:
            gap_m, leader_mps = track.gap_m, max(0.0, track.speed_mps)  # traffic ahead does not drive backwards
            notes |= {"gap_m": gap_m, "leader_mps": leader_mps}
        acceleration_mps2 = max(-CRUISE_BRAKING_MPS2, following(speed_mps, observation.cruise_mps, gap_m, leader_mps))
        if speed_mps < HOLD_MPS and leader_mps < HOLD_MPS and gap_m < HOLD_GAP_M:
            acceleration_mps2 = min(acceleration_mps2, -CRUISE_BRAKING_MPS2)
        if self._brakes(gap_m, speed_mps - leader_mps, speed_mps):
            acceleration_mps2 = -observation.car.most_braking_mps2
            notes["is_emergency"] = 1.0
        return Action(acceleration_mps2=acceleration_mps2, steering_rad=steering(observation), notes=notes)

    def _brakes(self, gap_m: float, closing_mps: float, speed_mps: float) -> bool:
        """Whether the emergency brake acts; once it acts, it acts until the danger is over."""
        is_near = closing_mps > CLOSING_MPS and max(gap_m, 0.0) < self._emergency_ttc_s * closing_mps
        is_over = speed_mps <= 0 or (closing_mps <= CLOSING_MPS and gap_m > RELEASE_GAP_M)
        self._is_braking = is_near or (self._is_braking and not is_over)
        return self._is_braking


def following(speed_mps: float, cruise_mps: float, gap_m: float, leader_mps: float) -> float:
    """Returns the acceleration of the intelligent driver model in m/s², negative for braking.

    Args:
        speed_mps: speed of the car.
        cruise_mps: desired speed on a free road.
        gap_m: free distance to the obstacle ahead; infinite without one.
        leader_mps: speed of the obstacle.
    """
    closing_m = speed_mps * (speed_mps - leader_mps) / (2 * math.sqrt(ACCELERATION_MPS2 * COMFORTABLE_MPS2))
    wanted_m = STANDSTILL_GAP_M + max(0.0, speed_mps * HEADWAY_S + closing_m)
    free = (speed_mps / max(cruise_mps, 0.1)) ** 4
    return ACCELERATION_MPS2 * (1 - free - (wanted_m / max(gap_m, 0.1)) ** 2)


def steering(observation: Observation) -> float:
    """Returns the steering angle in radians by which the middle of the rear axle follows the path (pure pursuit);
    positive to the left.

    Args:
        observation: path in the ego frame, speed and wheelbase.
    """
    rear = np.array([-observation.car.wheelbase_m / 2, 0.0])
    look_ahead_m = max(LEAST_LOOK_AHEAD_M, LOOK_AHEAD_S * observation.ego.speed_mps)
    distances_m = np.linalg.norm(observation.path_m - rear, axis=1)
    beyond = np.flatnonzero(distances_m >= look_ahead_m)
    target = observation.path_m[int(beyond[0]) if len(beyond) else -1] - rear
    squared_m2 = float(target @ target)
    return math.atan2(2 * observation.car.wheelbase_m * float(target[1]), max(squared_m2, 1e-9))
