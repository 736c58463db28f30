"""The physical part of the closed loop as an object that is stepped: `reset` begins a drive, `step` moves all by a
frame.

Pictures are not needed here: a caller that wants them renders `DriveSimulation.record`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from gear.contracts.controllers import Action, CarFacts, Observation, Obstacle, Points
from gear.driving.crash import Crash, CrashDetector, impact_mps
from gear.driving.dynamics import Dynamics, DynamicsName, PlanarCar
from gear.driving.lane_path import PathPosition, to_ego
from gear.driving.road_users import RoadUserMotion
from gear.driving.start import Draw, Start, StartSampler
from gear.driving.vehicle import VehicleState, car_facts
from gear.driving.wheeled_car import WheeledCar
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import SceneRecord
from gear.world.assets.actor_types import ActorType
from gear.world.placement import PlacementSpace
from gear.world.planner import actor_record
from gear.world.roads.junctions import Junctions
from gear.world.scene_spec import SceneSpec
from gear.world.traffic.spawn import Spawn
from gear.world.world import World

FRAME_S = 0.1
"""Time between two frames: the loop runs at 10 Hz."""

TICKS = 4
"""Number of steps per frame in which vehicles move and contacts are searched."""

NEAR_M = 25.0
"""Distance from the ego car within which contacts are searched, metres; longer than half of any vehicle."""

STOOD_S = 1.5
"""Time after which a car that stands ends the drive, seconds; on a free road it does not."""

LOST_M = 6.0
"""Distance from the centre line of the lane beyond which the car has left the road, metres."""

PASSED_M = 10.0
"""Distance beyond a walking or standing person, or beyond a stop line, at which the drive ends, metres."""

Ending = Literal["", "crash", "time", "stood", "passed", "off_road"]
"""Why a drive ended: contact, end of its time, a standing car, a person or a red light that was passed, or a car that
left the road; "" while it continues.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Situation:
    """The state of a drive at the time of a frame.

    Attributes:
        frame: number of the frame, from 0.
        time_s: time since the start.
        ego: the ego car.
        world_from_ego: its pose; its pitch and roll are those of the ground, or of the car's body with the dynamics
            `mujoco`.
        car: its sizes and limits.
        position: its position on its route.
        cruise_mps: its desired speed.
        path_m: (N, 2) centre line of the lane ahead, in the ego frame (x forward, y left).
        spawns: the other road users with their positions in the world, by name of their body.
        obstacles: the same road users with positions, sizes and velocities in the ego frame.
        red_light_m: distance from the front of the car to the stop line of the red light ahead; None without one, and
            after the car has passed the line.
        ran_red_light: whether the car has passed the stop line of a red light.
        crash: the first contact; None without one.
        ending: why the drive has ended: `crash`, `time`, `stood`, `passed` or `off_road`; "" before the end.
    """

    frame: int
    time_s: float
    ego: VehicleState
    world_from_ego: RigidTransform
    car: CarFacts
    position: PathPosition
    cruise_mps: float
    path_m: Points
    spawns: Mapping[str, Spawn]
    obstacles: tuple[Obstacle, ...]
    red_light_m: float | None = None
    ran_red_light: bool = False
    crash: Crash | None = None
    ending: Ending = ""

    @property
    def is_over(self) -> bool:
        """Whether the drive has ended."""
        return self.ending != ""

    def observation(
        self,
        cameras: tuple[CameraMount, ...] = (),
        prediction: Any = None,
        views: Mapping[str, Any] | None = None,
        *,
        with_truth: bool = False,
    ) -> Observation:
        """What a controller receives of this state.

        Args:
            cameras: cameras of the rig.
            prediction: the network's prediction.
            views: pictures by camera name, for controllers that see them.
            with_truth: whether the true positions of the road users and of the red light are included.
        """
        return Observation(
            time_s=self.time_s,
            ego=self.ego.ego,
            car=self.car,
            cruise_mps=self.cruise_mps,
            path_m=self.path_m,
            lane_width_m=self.position.lane_width_m,
            cameras=cameras,
            prediction=prediction,
            views=dict(views or {}),
            obstacles=self.obstacles if with_truth else (),
            red_light_m=self.red_light_m if with_truth else None,
        )


@dataclass(slots=True, eq=False, kw_only=True)
class _Drive:
    """The drive in progress."""

    draw: Draw
    start: Start
    motion: RoadUserMotion
    detector: CrashDetector
    dynamics: Dynamics
    ids: dict[str, int] = field(default_factory=dict)
    stood_s: float = 0.0


class DriveSimulation:
    """One world in which drives take place, one after another; it moves cars and people, and renders nothing. A drive
    depends only on its draw (scenario, speed and seed) and on the actions.
    """

    def __init__(self, world: World, crowd: SceneSpec, dynamics: DynamicsName = "kinematic") -> None:
        """Prepares drives in a world.

        Args:
            world: the compiled world.
            crowd: the scene with the numbers of the other road users.
            dynamics: model of the ego car's motion.
        """
        self._world, self._dynamics = world, dynamics
        self._wheeled_car: WheeledCar | None = None
        bodies = {slot.body: world.types[slot.actor.name] for slot in world.slots}
        self._space = PlacementSpace(world.placement_model, bodies, world.parked_m)
        self._sampler = StartSampler(world, crowd, self._space)
        self._junctions = Junctions(world.lanes)
        self._drive: _Drive | None = None
        self._situation: Situation | None = None

    @property
    def dynamics(self) -> DynamicsName:
        """Name of the model of the ego car's motion."""
        return self._dynamics

    @property
    def start(self) -> Start:
        """The start of the drive in progress."""
        return self._current[0].start

    @property
    def situation(self) -> Situation:
        """The current state of the drive in progress."""
        return self._current[1]

    @property
    def ids(self) -> Mapping[str, int]:
        """Ids of all road users of the drive in progress, by body; the ego car has 1."""
        return self._current[0].ids

    @property
    def assets(self) -> dict[str, str]:
        """Names of the assets of all road users of the drive in progress, by body."""
        return {body: spawn.actor_type.facts.name for body, spawn in self.start.road_users.spawns.items()}

    @property
    def scripted_id(self) -> int | None:
        """Id of the road user that follows the scenario's script; None on a free road."""
        scripted = self.start.lead or self.start.walker
        return None if scripted is None else self.ids[scripted.body]

    @property
    def _current(self) -> tuple[_Drive, Situation]:
        assert self._drive is not None and self._situation is not None, "call reset first"
        return self._drive, self._situation

    def reset(self, draw: Draw) -> Situation:
        """Begins a drive and returns its first state; an earlier drive ends.

        Args:
            draw: scenario, speed and seed of the drive.

        Raises:
            PlacementError: the scene has no place for the scenario.
        """
        start = self._sampler.draw(draw)
        body, spawn = next(iter(start.road_users.spawns.items()))
        duration_s = draw.scenario.duration_s
        motion = RoadUserMotion(start, self._world.lanes, self._junctions, seed=draw.seed, duration_s=duration_s)
        self._drive = _Drive(
            draw=draw,
            start=start,
            motion=motion,
            detector=CrashDetector(self._space, body, spawn.actor_type),
            dynamics=self._dynamics_of(spawn.actor_type),
            ids={name: number for number, name in enumerate(start.road_users.spawns, start=1)},
        )
        state = VehicleState(x_m=spawn.x_m, y_m=spawn.y_m, yaw_rad=spawn.yaw_rad, speed_mps=start.speed_mps)
        position = start.path.locate(state, start.s_m)
        pose = start.road_users.poses[body]
        self._drive.dynamics.reset(state, pose)
        self._situation = self._at(0, state, position, pose, motion.spawns())
        return self._situation

    def step(self, action: Action) -> Situation:
        """Moves the ego car and all other road users by one frame, and returns the new state.

        The drive stops at the first contact. After the end of a drive the state does not change.

        Args:
            action: acceleration and steering, held for the whole frame.
        """
        drive, now = self._current
        if now.is_over:
            return now
        state, position, pose = now.ego, now.position, now.world_from_ego
        crash, tick_s = None, FRAME_S / TICKS
        for tick in range(1, TICKS + 1):
            state = drive.dynamics.step(action, tick_s)
            position = drive.start.path.locate(state, position.s_m)
            drive.motion.advance(tick_s, position, state.speed_mps)
            height_m = float(pose.translation_m[2])
            near = drive.detector.overlapping(
                drive.detector.footprint(state.x_m, state.y_m, height_m, state.yaw_rad),
                drive.motion.within(state.x_m, state.y_m, NEAR_M),
            )
            is_last = tick == TICKS
            if near or is_last:
                pose = drive.dynamics.pose() or drive.detector.ego_pose(state.x_m, state.y_m, height_m, state.yaw_rad)
            body = drive.detector.hit(pose, near)
            if body is not None or (is_last and drive.detector.hits_town(pose)):
                crash = self._crash(now.time_s + tick * tick_s, state, near, body)
                break
        spawns = drive.motion.spawns()
        drive.stood_s = drive.stood_s + FRAME_S if state.speed_mps < 0.05 else 0.0
        following = self._at(now.frame + 1, state, position, pose, spawns)
        ending = "crash" if crash is not None else self._ending(following)
        self._situation = replace(following, crash=crash, ending=ending)
        return self._situation

    def record(self, rig: Rig, index: int) -> SceneRecord:
        """The scene record of the current state, which a renderer draws. With the dynamics `mujoco`, the cameras have
        the pitch and the roll of the car's body.

        Args:
            rig: the cameras on the ego car.
            index: index of the sample in the record.
        """
        drive, now = self._current
        ego_body, ego = next(iter(drive.start.road_users.spawns.items()))
        ego = replace(ego, x_m=now.ego.x_m, y_m=now.ego.y_m, yaw_rad=now.ego.yaw_rad, speed_mps=now.ego.speed_mps)
        actors = [actor_record(drive.ids[ego_body], ego, now.world_from_ego)]
        for body, spawn in now.spawns.items():
            is_still = body not in drive.motion.moving
            standing = drive.start.road_users.poses[body] if is_still else drive.detector.pose(spawn)
            actors.append(actor_record(drive.ids[body], spawn, standing))
        carrier = next((actor.id for actor in actors if actor.role == "carrier"), None)
        placed = rig if self._dynamics == "kinematic" else replace(rig, follows_road=True)
        pose = now.world_from_ego
        return SceneRecord(
            town=self._world.town_name,
            scene=self._world.scene_name,
            split="drive",
            seed=drive.draw.seed,
            index=index,
            sequence=0,
            frame=now.frame,
            time_s=round(now.time_s, 9),
            weather=self._world.weather,
            actors=tuple(actors),
            surfaces=self._world.surface_records(carrier),
            cameras=placed.place(RigidTransform.from_parts("world", "ego", pose.rotation, pose.translation_m)),
        )

    def _dynamics_of(self, actor_type: ActorType) -> Dynamics:
        """The model of the ego car; the four-wheeled car is compiled once."""
        if self._dynamics == "kinematic":
            return PlanarCar(car_facts(actor_type))
        if self._wheeled_car is None:
            self._wheeled_car = WheeledCar(self._world.placement_model, actor_type)
        return self._wheeled_car

    def _at(
        self, frame: int, state: VehicleState, position: PathPosition, pose: RigidTransform, spawns: Mapping[str, Spawn]
    ) -> Situation:
        drive = self._drive
        assert drive is not None
        red_light_m = drive.start.conflict_s_m - position.s_m if drive.draw.scenario.red_light else None
        has_passed = red_light_m is not None and red_light_m < 0
        return Situation(
            frame=frame,
            time_s=frame * FRAME_S,
            ego=state,
            world_from_ego=pose,
            car=drive.dynamics.car,
            position=position,
            cruise_mps=drive.start.speed_mps,
            path_m=drive.start.path.ahead(state, position.s_m),
            spawns=spawns,
            obstacles=tuple(_obstacle(state, drive.ids[body], spawn) for body, spawn in spawns.items()),
            red_light_m=None if has_passed else red_light_m,
            ran_red_light=has_passed,
        )

    def _crash(self, time_s: float, state: VehicleState, spawns: Mapping[str, Spawn], body: str | None) -> Crash:
        assert self._drive is not None
        spawn = None if body is None else spawns[body]
        kind = "static" if spawn is None else "person" if spawn.actor_type.is_person else "vehicle"
        return Crash(
            time_s=time_s,
            actor_id=0 if body is None else self._drive.ids[body],
            kind=kind,
            impact_mps=impact_mps(state.speed_mps, state.yaw_rad, spawn),
        )

    def _ending(self, now: Situation) -> Ending:
        drive = self._drive
        assert drive is not None
        if abs(now.position.lateral_m) > LOST_M:
            return "off_road"
        if drive.stood_s >= STOOD_S - 1e-9 and not drive.draw.scenario.is_free:
            return "stood"
        can_pass = drive.start.walker is not None or drive.draw.scenario.red_light
        if can_pass and now.position.s_m > drive.start.conflict_s_m + PASSED_M:
            return "passed"
        return "time" if now.time_s >= drive.draw.scenario.duration_s - 1e-9 else ""


def _obstacle(state: VehicleState, number: int, spawn: Spawn) -> Obstacle:
    """A road user in the ego frame."""
    place = to_ego(state, np.array([[spawn.x_m, spawn.y_m]]))[0]
    turned_rad = math.remainder(spawn.yaw_rad - state.yaw_rad, 2 * math.pi)
    return Obstacle(
        id=number,
        kind="person" if spawn.actor_type.is_person else "vehicle",
        ahead_m=float(place[0]),
        left_m=float(place[1]),
        yaw_rad=turned_rad,
        half_length_m=spawn.actor_type.half_length_m,
        half_width_m=spawn.actor_type.half_width_m,
        velocity_mps=(spawn.speed_mps * math.cos(turned_rad), spawn.speed_mps * math.sin(turned_rad)),
    )
