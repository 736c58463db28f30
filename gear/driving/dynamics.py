"""The two models of the ego car's motion behind one protocol: the kinematic bicycle, and a four-wheeled car in MuJoCo.

Both follow the same commands with the same lag and the same limits, so controllers need not know which one they drive.
"""

from __future__ import annotations

from typing import Literal, Protocol

from gear.contracts.controllers import Action, CarFacts
from gear.driving.vehicle import KinematicBicycle, VehicleState
from gear.values.geometry import RigidTransform

DynamicsName = Literal["kinematic", "mujoco"]
"""Names of the models: `kinematic` is the bicycle of `gear.driving.vehicle`, `mujoco` the car of
`gear.driving.wheeled_car`.
"""


class Dynamics(Protocol):
    """A model of the ego car's motion. It holds the state of one car."""

    @property
    def car(self) -> CarFacts:
        """Sizes and limits of the car."""
        ...

    def reset(self, state: VehicleState, world_from_car: RigidTransform) -> None:
        """Begins a drive; nothing of an earlier drive remains.

        Args:
            state: position and speed at the start.
            world_from_car: the car's pose on the ground at the start.
        """
        ...

    def step(self, action: Action, duration_s: float) -> VehicleState:
        """Moves the car, and returns its new state.

        Args:
            action: acceleration and steering; values beyond the car's limits are reduced to them.
            duration_s: time span, in seconds, during which the action does not change.
        """
        ...

    def pose(self) -> RigidTransform | None:
        """The car's pose in the world with pitch and roll; None for a model that moves in the plane, for which the
        ground decides them.
        """
        ...


class PlanarCar:
    """The kinematic bicycle with the state of one car.

    Args:
        car: sizes and limits of the car.
    """

    def __init__(self, car: CarFacts) -> None:
        self._bicycle = KinematicBicycle(car=car)
        self._state = VehicleState(x_m=0.0, y_m=0.0, yaw_rad=0.0, speed_mps=0.0)

    @property
    def car(self) -> CarFacts:
        """Sizes and limits of the car."""
        return self._bicycle.car

    def reset(self, state: VehicleState, world_from_car: RigidTransform) -> None:
        """Begins a drive at a state; the pose on the ground is not used.

        Args:
            state: position and speed at the start.
            world_from_car: not used.
        """
        self._state = state

    def step(self, action: Action, duration_s: float) -> VehicleState:
        """Moves the car, and returns its new state.

        Args:
            action: acceleration and steering; values beyond the car's limits are reduced to them.
            duration_s: time span, in seconds, during which the action does not change.
        """
        self._state = self._bicycle.step(self._state, action, duration_s)
        return self._state

    def pose(self) -> RigidTransform | None:
        """Returns None: the bicycle moves in the plane."""
        return None
