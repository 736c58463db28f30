"""Driving sequences: moves the road users of a sample from frame to frame, without overlaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gear.values.errors import PlacementError
from gear.values.geometry import Array, RigidTransform
from gear.values.rng import derive_rng
from gear.world.placement import PlacementSpace
from gear.world.roads.junctions import Junctions
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route, extend_route, moving_pose, vehicle_pose
from gear.world.traffic.crowd import RoadUsers
from gear.world.traffic.simulation import MovingPedestrian, MovingVehicle, TrafficSimulation, vehicle_discs
from gear.world.traffic.spawn import Spawn

ROOM_M = 80.0
"""Extra length of a vehicle's route in metres, in addition to the longest distance that the vehicle can drive in the
sequence.
"""

SLOWEST_MPS = 1.5
"""Smallest cruising speed of the ego car while it is within its limits, m/s."""

OFF_THE_ROAD_M = 1.2
"""Distance in metres that people walk beyond the end of a crosswalk, onto the sidewalk. On a sidewalk, they stop this
distance before its end.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FrameState:
    """The road users in one frame of a sequence.

    Attributes:
        spawns: the road users by body, with their positions and speeds in this frame.
        poses: their poses in world coordinates, by body.
    """

    spawns: Mapping[str, Spawn]
    poses: Mapping[str, RigidTransform]


class SequenceSimulator:
    """Simulates the road users of a sample through all frames of a sequence."""

    def __init__(self, scene_name: str, lanes: LaneGraph, space: PlacementSpace) -> None:
        """Prepares simulations in a town.

        Args:
            scene_name: name of the scene, for error messages.
            lanes: lane graph of the town.
            space: the placement model, which finds overlaps.
        """
        self._scene_name = scene_name
        self._lanes = lanes
        self._space = space
        self._junctions = Junctions(lanes)

    def drive(
        self, road_users: RoadUsers, seed: int, sequence: int, frames: int, interval_s: float
    ) -> list[FrameState]:
        """Simulates all frames of a sequence and returns the state of the road users in each frame.

        If two actors overlap, or an actor has no ground below it, one actor is removed and the sequence is simulated
        again, until this does not occur. The frames may therefore contain fewer road users than the scene's smallest
        count, which is only guaranteed before the simulation.

        Args:
            road_users: the road users at the start; removed actors are removed from this object as well.
            seed: seed of the split.
            sequence: number of the sequence; together with `seed` it determines all random draws.
            frames: number of frames.
            interval_s: time between two frames, seconds.

        Raises:
            PlacementError: the ego car, or the carrier of the patch, overlaps another object or leaves the ground.
        """
        while True:
            states, overlapping = self._simulate_once(road_users, seed, sequence, frames, interval_s)
            if overlapping is None:
                return states
            if overlapping in road_users.protected:
                raise PlacementError(
                    self._scene_name,
                    f"sequence {sequence}: the ego car cannot drive {frames} frames without an overlap",
                )
            road_users.drop(overlapping)

    def _simulate_once(
        self, road_users: RoadUsers, seed: int, sequence: int, frames: int, interval_s: float
    ) -> tuple[list[FrameState], str | None]:
        """Simulates until the end or until an actor overlaps.

        Returns:
            The frames, and the body of the actor that overlaps, or None.
        """
        duration_s = frames * interval_s
        vehicles = {
            body: self._moving_vehicle(road_users, spawn, seed, sequence, duration_s)
            for body, spawn in road_users.spawns.items()
            if spawn.lane
        }
        people = {
            body: moving_person(self._lanes, spawn)
            for body, spawn in road_users.spawns.items()
            if spawn.walk is not None and spawn.speed_mps > 0
        }
        grounded = [
            disc
            for body, spawn in road_users.spawns.items()
            if body not in vehicles and body not in people
            for disc in standing_discs(spawn)
        ]
        traffic = TrafficSimulation(list(vehicles.values()), list(people.values()), grounded, self._junctions)
        order = {body: number for number, body in enumerate(road_users.spawns)}
        states: list[FrameState] = []
        for frame in range(frames):
            if frame:
                traffic.advance(interval_s)
            state, fallen = self._frame_state(road_users, vehicles, people, is_still=frames == 1)
            pairs = self._space.overlaps(state.poses)
            overlapping = [max(pair, key=lambda body: order.get(body, -1)) for pair in pairs] + fallen
            if overlapping:
                return states, max(overlapping, key=lambda body: order[body])
            states.append(state)
        return states, None

    def _frame_state(
        self,
        road_users: RoadUsers,
        vehicles: Mapping[str, MovingVehicle],
        people: Mapping[str, MovingPedestrian],
        *,
        is_still: bool,
    ) -> tuple[FrameState, list[str]]:
        """The road users at the current time, and the bodies of those that have no ground below them.

        In a single picture (`is_still`) vehicles and people head along their segment of the lane or walk; in motion
        their heading changes steadily from segment to segment.
        """
        spawns: dict[str, Spawn] = {}
        poses: dict[str, RigidTransform] = {}
        fallen: list[str] = []
        for body, spawn in road_users.spawns.items():
            if body in vehicles:
                vehicle = vehicles[body]
                half_length_m = spawn.actor_type.half_length_m
                if is_still:
                    point, yaw_rad = vehicle_pose(vehicle.route.line, vehicle.s_m, half_length_m, vehicle.lateral_m)
                    now = moved(spawn, point, yaw_rad, vehicle.speed_mps)
                else:
                    point, yaw_rad, pace = moving_pose(
                        vehicle.route.line, vehicle.s_m, half_length_m, vehicle.lateral_m
                    )
                    now = moved(spawn, point, yaw_rad, vehicle.speed_mps * pace)
            elif body in people:
                person = people[body]
                point, yaw_rad = person.first_place() if is_still else person.place()
                now = moved(spawn, point, yaw_rad, person.speed_mps)
            else:
                spawns[body], poses[body] = spawn, road_users.poses[body]
                continue
            grounded = self._space.ground_pose(spawn.actor_type, now.x_m, now.y_m, now.near_z_m, now.yaw_rad)
            if grounded is None:
                fallen.append(body)
                continue
            spawns[body], poses[body] = now, grounded.world_from_actor
        return FrameState(spawns=spawns, poses=poses), fallen

    def _moving_vehicle(
        self, road_users: RoadUsers, spawn: Spawn, seed: int, sequence: int, duration_s: float
    ) -> MovingVehicle:
        lane = self._lanes.lanes[spawn.lane]
        cruise_mps = lane.speed_mps * float(
            derive_rng(seed, self._scene_name, "cruise", sequence, spawn.body).uniform(0.6, 1.0)
        )
        if spawn.role == "ego" and road_users.drive_m > 0:
            cruise_mps = min(lane.speed_mps, max(SLOWEST_MPS, road_users.drive_m / duration_s))
        elif spawn.actor_type.vehicle is not None:
            cruise_mps = min(cruise_mps, spawn.actor_type.vehicle.cruise_mps)
        way = road_users.required_lanes.get(spawn.body, (spawn.lane,))
        # The ego car and its truck draw the same numbers, so that they turn the same way at every junction.
        turns = derive_rng(
            seed, self._scene_name, "route", sequence, "leads" if spawn.body in road_users.protected else spawn.body
        )
        spent_m = sum(self._lanes.lanes[name].line.length_m for name in way[:-1])
        length_m = spawn.s_m + lane.speed_mps * duration_s + ROOM_M - spent_m
        lanes = (*way[:-1], *extend_route(self._lanes, way[-1], max(1.0, length_m), turns))
        return MovingVehicle(
            route=Route.along(self._lanes, lanes),
            s_m=spawn.s_m,
            lateral_m=spawn.lateral_m,
            speed_mps=spawn.speed_mps,
            cruise_mps=cruise_mps,
            front_m=spawn.actor_type.front_m,
            rear_m=spawn.actor_type.rear_m,
            half_width_m=spawn.actor_type.half_width_m,
        )


def moving_person(lanes: LaneGraph, spawn: Spawn) -> MovingPedestrian:
    """The motion of a person who was drawn on a walk of a town.

    Args:
        lanes: the lanes and walks of the town.
        spawn: the person, with walk, position and speed.
    """
    assert spawn.walk is not None
    walk = lanes.walks[spawn.walk.walk]
    return MovingPedestrian(
        line=walk.line,
        s_m=spawn.walk.s_m,
        lateral_m=spawn.walk.lateral_m,
        direction=spawn.walk.direction,
        pace_mps=spawn.speed_mps,
        speed_mps=spawn.speed_mps,
        beyond_m=OFF_THE_ROAD_M if walk.is_crossing else -OFF_THE_ROAD_M,
    )


def standing_discs(spawn: Spawn) -> list[tuple[float, float, float, float]]:
    """Discs (x, y, z, radius) in metres that cover a standing road user.

    Args:
        spawn: the road user.
    """
    actor_type = spawn.actor_type
    point_m = np.array([spawn.x_m, spawn.y_m, spawn.near_z_m])
    return vehicle_discs(point_m, spawn.yaw_rad, actor_type.front_m, actor_type.rear_m, actor_type.half_width_m)


def moved(spawn: Spawn, point_m: Array, yaw_rad: float, speed_mps: float) -> Spawn:
    """Returns a copy of a road user with another position, heading and speed.

    Args:
        spawn: the road user.
        point_m: (3,) point on the ground in world coordinates.
        yaw_rad: heading, counter-clockwise from east.
        speed_mps: speed in metres per second.
    """
    return replace(
        spawn,
        x_m=float(point_m[0]),
        y_m=float(point_m[1]),
        near_z_m=float(point_m[2]),
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
    )
