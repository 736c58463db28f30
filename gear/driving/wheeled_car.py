"""The ego car as a four-wheeled car in MuJoCo: suspension, tyres, steering, drive and brakes on the town's ground.

The car is `mjcf/dynamics/car.xml`, with the wheelbase, the width and the mass of the ego car. Tyres are ellipsoids;
their contact with the ground is MuJoCo's, with Coulomb friction in an elliptic cone. The car obeys the same commands as
the kinematic bicycle (`gear.driving.vehicle`): acceleration and steering follow them with the same lag and within the
same limits. A low-level controller turns the acceleration into torques of the motors and the brakes: a feedforward of
the force, and a feedback on the speed that the commands ask for, as in an adaptive cruise control. Brakes have an
anti-lock system, and their force is distributed to the axles like the load on them. Spring rates follow from the
frequency and the damping ratio of the body's heave (Gillespie, "Fundamentals of Vehicle Dynamics", chapter 5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from gear.contracts.controllers import Action, CarFacts
from gear.driving.vehicle import FRICTION_MPS2, LAG_S, VehicleState, car_facts
from gear.values.errors import GearError
from gear.values.geometry import RigidTransform
from gear.values.resources import data_dir
from gear.world.assets.actor_types import ActorType
from gear.world.compilation.model_compilation import GROUND_GROUP

GRAVITY_MPS2 = 9.81
TYRE_FRICTION = FRICTION_MPS2 / GRAVITY_MPS2
"""Coefficient of friction of the tyres on a dry road; it gives the friction circle of the kinematic bicycle."""

STEP_S = 0.0025
"""Longest time step of the physics, seconds."""

HEAVE_HZ, DAMPING_RATIO = 1.5, 0.4
"""Natural frequency and damping ratio of the body on its springs."""

CENTRE_SHARE, CENTRE_HEIGHT_SHARE = 0.03, 0.36
"""Position of the centre of mass: in front of the middle as a share of the wheelbase, and above the ground as a share
of the car's height.
"""

TRACK_SHARE = 0.84
"""Distance of the wheels' middles from the middle of the car, as a share of half its width."""

SPEED_GAIN_PER_S, INTEGRAL_GAIN_PER_S2, MOST_INTEGRAL_MPS2, MOST_LAG_MPS = 4.0, 3.0, 2.0, 0.4
"""Feedback of the speed controller: acceleration per speed that is missing and per way that is missing, the largest
acceleration of the second part (a slope of 20 %), and the largest missing speed that counts.
"""

LEAST_SLIP, MOST_SLIP, SLIP_MPS = 0.1, 0.3, 0.7
"""The anti-lock system reduces the brake of a wheel from the first slip on, and releases it at the second, while the
car is faster than this speed. Slip is the share of the car's speed by which the tyre slides.
"""

STANDS_MPS = 0.02
"""Speed below which a braked car stands, m/s."""

UNSTABLE = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)
"""Warnings after which MuJoCo begins again from the start, so that the state is lost."""

WHEELS = ("front_left", "front_right", "rear_left", "rear_right")


@dataclass(slots=True, eq=False, kw_only=True)
class _Wheel:
    """Addresses of one wheel in the MuJoCo model."""

    spin_dof: int
    is_front: bool
    drive: int = -1
    steering: int = -1


class WheeledCar:
    """A four-wheeled car on the ground of a town."""

    def __init__(self, town: mujoco.MjModel, actor_type: ActorType, friction: float = TYRE_FRICTION) -> None:
        """Compiles the car with the ground of a town.

        Args:
            town: the placement model of the world, whose ground geoms the car drives on.
            actor_type: asset of the car, with its measured size and its mass.
            friction: coefficient of friction of tyres and ground.
        """
        self._car = car_facts(actor_type)
        self._model = _compiled(town, actor_type, self._car, friction)
        self._data = mujoco.MjData(self._model)
        body = self._model.body("chassis")
        self._body, self._mass_kg = int(body.id), float(body.subtreemass[0])
        self._height_m = float(self._model.body_ipos[self._body, 2])
        self._rear_m = self._car.wheelbase_m / 2 + float(self._model.body_ipos[self._body, 0])
        self._radius_m = float(self._model.geom("front_left_tyre").size[0])
        self._half_track_m = float(self._model.body("front_left").pos[1])
        self._wheels = tuple(self._wheel(name) for name in WHEELS)
        spinning = float(sum(self._model.dof_M0[wheel.spin_dof] for wheel in self._wheels))
        self._moved_kg = self._mass_kg + spinning / self._radius_m**2
        self._acceleration_mps2 = self._steering_rad = self._wanted_mps = self._integral_mps2 = 0.0

    @property
    def car(self) -> CarFacts:
        """Sizes and limits of the car."""
        return self._car

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled car with the ground."""
        return self._model

    @property
    def data(self) -> mujoco.MjData:
        """The physical state of the car."""
        return self._data

    def reset(self, state: VehicleState, world_from_car: RigidTransform) -> None:
        """Begins a drive: the car rolls with its speed, and its springs carry it.

        Args:
            state: position and speed at the start.
            world_from_car: the car's pose on the ground at the start.
        """
        mujoco.mj_resetData(self._model, self._data)
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(world_from_car.rotation).reshape(-1))
        self._data.qpos[:7] = (*world_from_car.translation_m, *quat)
        self._data.qvel[:3] = world_from_car.rotation[:, 0] * state.speed_mps
        for wheel in self._wheels:
            self._data.qvel[wheel.spin_dof] = state.speed_mps / self._radius_m
        self._acceleration_mps2, self._steering_rad = state.acceleration_mps2, state.steering_rad
        self._wanted_mps, self._integral_mps2 = state.speed_mps, 0.0
        self._brake([0.0] * len(WHEELS))
        mujoco.mj_forward(self._model, self._data)

    def step(self, action: Action, duration_s: float) -> VehicleState:
        """Moves the car, and returns its new state.

        Args:
            action: acceleration and steering; values beyond the car's limits are reduced to them.
            duration_s: time span, in seconds, during which the action does not change; it is integrated in steps of
                at most `STEP_S`.

        Raises:
            GearError: the physics became unstable.
        """
        steps = max(1, math.ceil(duration_s / STEP_S - 1e-9))
        self._model.opt.timestep = duration_s / steps
        before_mps = self._speed_mps()
        for _ in range(steps):
            self._control(action, duration_s / steps)
            mujoco.mj_step(self._model, self._data)
        if any(self._data.warning[kind].number for kind in UNSTABLE):
            raise GearError(
                f"dynamics mujoco: the physics of the car became unstable {self._data.time:.2f} s after reset"
            )
        mujoco.mj_kinematics(self._model, self._data)
        return self._state(before_mps, duration_s)

    def pose(self) -> RigidTransform:
        """The car's pose in the world, with the pitch and the roll of its body."""
        rotation = self._data.xmat[self._body].reshape(3, 3).copy()
        return RigidTransform.from_parts("world", "actor", rotation, self._data.xpos[self._body].copy())

    def _state(self, before_mps: float, duration_s: float) -> VehicleState:
        x_m, y_m, _ = self._data.xpos[self._body]
        ahead = self._data.xmat[self._body].reshape(3, 3)[:, 0]
        speed_mps = self._speed_mps()
        stands = self._wanted_mps == 0 and speed_mps < STANDS_MPS
        return VehicleState(
            x_m=float(x_m),
            y_m=float(y_m),
            yaw_rad=math.atan2(ahead[1], ahead[0]),
            speed_mps=0.0 if stands else max(0.0, speed_mps),
            acceleration_mps2=0.0 if stands else (speed_mps - before_mps) / duration_s,
            steering_rad=self._steering_rad,
            yaw_rate_radps=float(self._data.qvel[3:6] @ self._data.xmat[self._body].reshape(3, 3)[2]),
        )

    def _speed_mps(self) -> float:
        """Speed of the car's middle along its heading; negative backwards."""
        return float(self._data.qvel[:3] @ self._data.xmat[self._body].reshape(3, 3)[:, 0])

    def _control(self, action: Action, step_s: float) -> None:
        """Sets steering, motors and brakes for one step of the physics."""
        car, share = self._car, 1 - math.exp(-step_s / LAG_S)
        asked_mps2 = min(max(action.acceleration_mps2, -car.most_braking_mps2), car.most_acceleration_mps2)
        asked_rad = min(max(action.steering_rad, -car.most_steering_rad), car.most_steering_rad)
        self._acceleration_mps2 += share * (asked_mps2 - self._acceleration_mps2)
        self._steering_rad += share * (asked_rad - self._steering_rad)
        self._steer()
        speed_mps = self._speed_mps()
        self._wanted_mps = max(0.0, self._wanted_mps + self._acceleration_mps2 * step_s)
        if self._wanted_mps == 0 and self._acceleration_mps2 < 0:
            self._acceleration_mps2 = 0.0
        self._wanted_mps = min(max(self._wanted_mps, speed_mps - MOST_LAG_MPS), max(0.0, speed_mps) + MOST_LAG_MPS)
        if self._wanted_mps == 0 and asked_mps2 <= 0:
            self._drive(0.0)
            self._brake(self._shares(car.most_braking_mps2, speed_mps))
            return
        missing_mps = self._wanted_mps - speed_mps
        integral_mps2 = self._integral_mps2 + INTEGRAL_GAIN_PER_S2 * missing_mps * step_s
        self._integral_mps2 = min(max(integral_mps2, -MOST_INTEGRAL_MPS2), MOST_INTEGRAL_MPS2)
        mps2 = self._acceleration_mps2 + SPEED_GAIN_PER_S * missing_mps + self._integral_mps2
        self._drive(max(0.0, mps2))
        self._brake(self._shares(max(0.0, -mps2), speed_mps))

    def _steer(self) -> None:
        """Turns the front wheels after Ackermann: the axes of all wheels meet in one point."""
        curvature_m = math.tan(self._steering_rad) / self._car.wheelbase_m
        for wheel, side in zip(self._wheels[:2], (1.0, -1.0), strict=True):
            angle_rad = math.atan2(self._car.wheelbase_m * curvature_m, 1 - side * self._half_track_m * curvature_m)
            self._data.ctrl[wheel.steering] = angle_rad

    def _drive(self, mps2: float) -> None:
        torque_nm = self._moved_kg * mps2 * self._radius_m / 2
        for wheel in self._wheels[:2]:
            self._data.ctrl[wheel.drive] = torque_nm

    def _shares(self, mps2: float, speed_mps: float) -> list[float]:
        """Brake torques of the wheels in N·m: distributed like the load on the axles, less on a wheel that slips."""
        moved = mps2 * self._height_m / GRAVITY_MPS2
        front = min(1.0, (self._rear_m + moved) / self._car.wheelbase_m)
        torque_nm = self._moved_kg * mps2 * self._radius_m
        torques = []
        for wheel in self._wheels:
            share = (front if wheel.is_front else 1 - front) / 2
            rolled_mps = float(self._data.qvel[wheel.spin_dof]) * self._radius_m
            slip = 1 - rolled_mps / speed_mps if speed_mps > SLIP_MPS else 0.0
            kept = min(max((MOST_SLIP - slip) / (MOST_SLIP - LEAST_SLIP), 0.0), 1.0)
            torques.append(torque_nm * share * kept)
        return torques

    def _brake(self, torques_nm: list[float]) -> None:
        """Sets the friction of the wheels' bearings: unlike a motor, it holds a wheel that stands."""
        for wheel, torque_nm in zip(self._wheels, torques_nm, strict=True):
            self._model.dof_frictionloss[wheel.spin_dof] = torque_nm

    def _wheel(self, name: str) -> _Wheel:
        is_front = name.startswith("front")
        return _Wheel(
            spin_dof=int(self._model.joint(f"{name}_spin").dofadr[0]),
            is_front=is_front,
            drive=int(self._model.actuator(f"{name}_drive").id) if is_front else -1,
            steering=int(self._model.actuator(f"{name}_steering").id) if is_front else -1,
        )


def _compiled(town: mujoco.MjModel, actor_type: ActorType, car: CarFacts, friction: float) -> mujoco.MjModel:
    """The model of the car, with the sizes of the ego car, on the ground of the town."""
    spec = mujoco.MjSpec.from_file(str(data_dir("mjcf") / "dynamics" / "car.xml"))
    _add_ground(spec, town, friction)
    body = actor_type.placement_body
    chassis = spec.body("chassis")
    length_m, width_m, height_m = car.front_m + car.rear_m, 2 * car.half_width_m, body.height_m
    wheels_kg = 4 * spec.geom("front_left_tyre").mass
    sprung_kg = body.mass_kg - wheels_kg
    ahead_m = CENTRE_SHARE * car.wheelbase_m
    chassis.mass = sprung_kg
    chassis.ipos = [ahead_m, 0.0, CENTRE_HEIGHT_SHARE * height_m]
    # A box with the sizes of the body, a fifth smaller because most mass is inside.
    x, y, z = 0.8 * length_m, 0.8 * width_m, 0.8 * height_m
    chassis.inertia = [sprung_kg / 12 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y))]
    hull = spec.geom("hull")
    hull.size = [length_m / 2, car.half_width_m, (height_m - 0.2) / 2]
    hull.pos = [(car.front_m - car.rear_m) / 2, 0.0, 0.2 + (height_m - 0.2) / 2]
    rate = 2 * math.pi * HEAVE_HZ
    for name in WHEELS:
        is_front, side = name.startswith("front"), 1 if name.endswith("left") else -1
        wheel = spec.body(name)
        tyre = spec.geom(f"{name}_tyre")
        place_m = car.wheelbase_m / 2 * (1 if is_front else -1)
        wheel.pos = [place_m, side * TRACK_SHARE * car.half_width_m, tyre.size[0]]
        tyre.friction = [friction, 0.005, 0.0001]
        share = 0.5 + ahead_m / car.wheelbase_m * (1 if is_front else -1)
        carried_kg = sprung_kg * share / 2
        spring = spec.joint(f"{name}_suspension")
        spring.stiffness = [carried_kg * rate**2, 0.0, 0.0]
        spring.damping = [2 * DAMPING_RATIO * carried_kg * rate, 0.0, 0.0]
        spring.springref = -GRAVITY_MPS2 / rate**2
    return spec.compile()


def _add_ground(spec: mujoco.MjSpec, town: mujoco.MjModel, friction: float) -> None:
    """Copies the ground geoms of the town."""
    data = mujoco.MjData(town)
    mujoco.mj_kinematics(town, data)
    for geom in np.flatnonzero(town.geom_group == GROUND_GROUP):
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom(int(town.geom_type[geom])),
            size=town.geom_size[geom],
            pos=data.geom_xpos[geom],
            quat=quat,
            contype=0,
            conaffinity=1,
            friction=[friction, 0.005, 0.0001],
        )
