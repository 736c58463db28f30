"""The ego car's motion: a kinematic bicycle with a delayed actuator, limited brakes and limited friction.

The model is that of Polack et al., "The kinematic bicycle model: a consistent model for planning feasible trajectories
for autonomous vehicles?" (IV 2017). Acceleration and steering follow their commands with a first-order lag. Tyres carry
a limited force in all directions together (friction circle): a car that brakes as hard as it can turns less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from gear.contracts.controllers import Action, CarFacts, EgoState
from gear.world.assets.actor_types import ActorType
from gear.world.roads.routes import HALF_WHEELBASE_SHARE

LAG_S = 0.2
"""Time constant with which acceleration and steering follow their commands, seconds."""

FRICTION_MPS2 = 9.0
"""Largest acceleration in any direction that the tyres carry, m/s²: a dry road."""

MOST_ACCELERATION_MPS2, MOST_BRAKING_MPS2, MOST_STEERING_RAD = 3.0, 8.0, 0.6
STEP_S = 0.005
"""Longest step of the integration, seconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleState:
    """Position and motion of the ego car.

    Attributes:
        x_m, y_m: middle of the footprint, world coordinates.
        yaw_rad: heading, counter-clockwise from east.
        speed_mps: speed of the middle, never negative.
        acceleration_mps2: longitudinal acceleration; negative while braking.
        steering_rad: steering angle of the front wheels, positive to the left.
        yaw_rate_radps: rate at which the heading changes.
    """

    x_m: float
    y_m: float
    yaw_rad: float
    speed_mps: float
    acceleration_mps2: float = 0.0
    steering_rad: float = 0.0
    yaw_rate_radps: float = 0.0

    @property
    def ego(self) -> EgoState:
        """The motion that a controller receives."""
        return EgoState(
            speed_mps=self.speed_mps, acceleration_mps2=self.acceleration_mps2, steering_rad=self.steering_rad
        )


def car_facts(actor_type: ActorType) -> CarFacts:
    """Sizes and limits of a car; the limits of acceleration, braking and steering are those of every car.

    Args:
        actor_type: asset of the car, with its measured size.
    """
    return CarFacts(
        wheelbase_m=2 * HALF_WHEELBASE_SHARE * actor_type.half_length_m,
        front_m=actor_type.front_m,
        rear_m=actor_type.rear_m,
        half_width_m=actor_type.half_width_m,
        most_acceleration_mps2=MOST_ACCELERATION_MPS2,
        most_braking_mps2=MOST_BRAKING_MPS2,
        most_steering_rad=MOST_STEERING_RAD,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class KinematicBicycle:
    """A model of a car's motion in the plane, the kinematic bicycle: the car moves where its wheels roll, without
    slipping sideways.

    Attributes:
        car: sizes and limits.
        friction_mps2: radius of the friction circle.
        lag_s: time constant of the actuators; 0 for none.
    """

    car: CarFacts
    friction_mps2: float = FRICTION_MPS2
    lag_s: float = LAG_S

    def step(self, state: VehicleState, action: Action, duration_s: float) -> VehicleState:
        """The state after a time span during which the action does not change.

        Args:
            state: the state at the start.
            action: acceleration and steering; values beyond the car's limits are reduced to them.
            duration_s: length of the time span; it is integrated in steps of at most `STEP_S`.
        """
        steps = max(1, math.ceil(duration_s / STEP_S - 1e-9))
        for _ in range(steps):
            state = self._step(state, action, duration_s / steps)
        return state

    def _step(self, state: VehicleState, action: Action, step_s: float) -> VehicleState:
        car = self.car
        wanted_mps2 = min(max(action.acceleration_mps2, -car.most_braking_mps2), car.most_acceleration_mps2)
        wanted_rad = min(max(action.steering_rad, -car.most_steering_rad), car.most_steering_rad)
        share = 1 - math.exp(-step_s / self.lag_s) if self.lag_s > 0 else 1.0
        acceleration_mps2 = state.acceleration_mps2 + share * (wanted_mps2 - state.acceleration_mps2)
        steering_rad = state.steering_rad + share * (wanted_rad - state.steering_rad)
        acceleration_mps2 = min(max(acceleration_mps2, -self.friction_mps2), self.friction_mps2)
        speed_mps = state.speed_mps + acceleration_mps2 * step_s
        driven_m = (state.speed_mps + max(speed_mps, 0.0)) / 2 * step_s
        if speed_mps < 0:  # it stops within the step: s = v² / 2a
            driven_m, speed_mps = -(state.speed_mps**2) / (2 * acceleration_mps2), 0.0
        side_mps2 = math.sqrt(max(0.0, self.friction_mps2**2 - acceleration_mps2**2))
        curvature = math.tan(steering_rad) / car.wheelbase_m
        slip_rad = math.atan(curvature * car.wheelbase_m / 2)
        turned = curvature * math.cos(slip_rad)
        if speed_mps > 0:
            most = side_mps2 / speed_mps**2
            turned = min(max(turned, -most), most)
        yaw_rad = state.yaw_rad + turned * driven_m
        heading_rad = (state.yaw_rad + yaw_rad) / 2 + slip_rad
        return replace(
            state,
            x_m=state.x_m + driven_m * math.cos(heading_rad),
            y_m=state.y_m + driven_m * math.sin(heading_rad),
            yaw_rad=yaw_rad,
            speed_mps=speed_mps,
            acceleration_mps2=0.0 if speed_mps == 0 and acceleration_mps2 < 0 else acceleration_mps2,
            steering_rad=steering_rad,
            yaw_rate_radps=turned * speed_mps,
        )
