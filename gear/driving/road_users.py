"""The other road users of a drive in motion: scripted ones follow their script, all others react to the ego car."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gear.driving.lane_path import PathPosition
from gear.driving.start import LeadStart, Start, WalkerStart
from gear.values.rng import derive_rng
from gear.world.roads.junctions import Junctions
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route, extend_route, moving_pose
from gear.world.traffic.sequence import ROOM_M, moved, moving_person, standing_discs
from gear.world.traffic.simulation import MovingPedestrian, MovingVehicle, TrafficSimulation
from gear.world.traffic.spawn import Spawn

CROWD_STEP_S = 0.05
"""Time between two steps of the road users that follow no script, seconds; scripted ones move in every step."""


class RoadUserMotion:
    """Moves all road users except the ego car, step by step: scripted ones follow their script, all others react to the
    ego car.
    """

    def __init__(self, start: Start, lanes: LaneGraph, junctions: Junctions, *, seed: int, duration_s: float) -> None:
        """Prepares the motion.

        Args:
            start: the start of the drive.
            lanes: lane graph of the town.
            junctions: conflicts between the junction lanes of the town.
            seed: seed of the routes and speeds of vehicles.
            duration_s: longest duration of the drive.
        """
        self._start, self._lanes, self._seed, self._duration_s = start, lanes, seed, duration_s
        self._spawns = dict(start.road_users.spawns)
        self._ego_body = next(iter(self._spawns))
        self._time_s = self._crowd_s = 0.0
        vehicles = {self._ego_body: self._driven(self._spawns[self._ego_body], start.s_m, 0.0, start.speed_mps)}
        people: dict[str, MovingPedestrian] = {}
        if start.lead is not None:
            spawn = self._spawns[start.lead.body]
            vehicles[start.lead.body] = self._driven(spawn, start.lead.s_m, start.lead.lateral_m, start.lead.speed_mps)
        if start.walker is not None:
            people[start.walker.body] = _driven_person(start.walker)
        for body, spawn in self._spawns.items():
            if body in vehicles or body in people:
                continue
            if spawn.lane:
                vehicles[body] = self._free_vehicle(spawn)
            elif spawn.walk is not None and spawn.speed_mps > 0:
                people[body] = moving_person(lanes, spawn)
        self._vehicles, self._people = vehicles, people
        standing = [
            disc
            for body, spawn in self._spawns.items()
            if body not in vehicles and body not in people
            for disc in standing_discs(spawn)
        ]
        self._traffic = TrafficSimulation(list(vehicles.values()), list(people.values()), standing, junctions)

    def advance(self, step_s: float, ego: PathPosition, ego_mps: float) -> None:
        """Moves all road users by a time span; the ego car is where the caller says.

        Args:
            step_s: the time span.
            ego: position of the ego car on its route.
            ego_mps: speed of the ego car.
        """
        car = self._vehicles[self._ego_body]
        car.s_m, car.lateral_m, car.speed_mps = ego.s_m, ego.lateral_m, ego_mps
        self._time_s += step_s
        if self._time_s - self._crowd_s > CROWD_STEP_S - 1e-9:
            self._traffic.advance(self._time_s - self._crowd_s)
            self._crowd_s = self._time_s
        if self._start.lead is not None:
            lead, vehicle = self._start.lead, self._vehicles[self._start.lead.body]
            vehicle.s_m = lead.s_m + lead.speed_mps * self._time_s
            vehicle.lateral_m = lateral_m(lead, self._time_s)
        if self._start.walker is not None:
            walker, person = self._start.walker, self._people[self._start.walker.body]
            walked_m = max(0.0, self._time_s - walker.waits_s) * walker.pace_mps
            person.s_m = min(walked_m, walker.line.length_m)
            person.speed_mps = walker.pace_mps if 0 < walked_m < walker.line.length_m else 0.0

    def spawns(self) -> dict[str, Spawn]:
        """All road users except the ego car, by name of their body, with their current positions and speeds."""
        return {body: self._now(body) for body in self._spawns if body != self._ego_body}

    def within(self, x_m: float, y_m: float, radius_m: float) -> dict[str, Spawn]:
        """The other road users near a point, at their positions of this moment; the ego car is left out.

        Args:
            x_m: the point in world coordinates.
            y_m: the point in world coordinates.
            radius_m: largest distance from the point.

        Returns:
            The road users by name of their body, as `spawns` returns them.
        """
        found: dict[str, Spawn] = {}
        for body, spawn in self._spawns.items():
            if body == self._ego_body:
                continue
            here_x_m, here_y_m = spawn.x_m, spawn.y_m
            mover = self._vehicles.get(body) or self._people.get(body)
            if mover is not None:
                line = mover.route.line if isinstance(mover, MovingVehicle) else mover.line
                point, _ = line.at(mover.s_m, mover.lateral_m)
                here_x_m, here_y_m = float(point[0]), float(point[1])
            if math.hypot(here_x_m - x_m, here_y_m - y_m) <= radius_m:
                found[body] = self._now(body)
        return found

    def _now(self, body: str) -> Spawn:
        """A road user at its current position."""
        spawn = self._spawns[body]
        if body in self._vehicles:
            vehicle = self._vehicles[body]
            half_length_m = spawn.actor_type.half_length_m
            point, yaw_rad, pace = moving_pose(vehicle.route.line, vehicle.s_m, half_length_m, vehicle.lateral_m)
            aside_mps = self._aside_mps(body)
            if aside_mps:
                yaw_rad += math.atan2(aside_mps, max(vehicle.speed_mps, 1.0))
            return moved(spawn, point, yaw_rad, vehicle.speed_mps * pace)
        if body in self._people:
            person = self._people[body]
            point, yaw_rad = person.first_place() if person.is_driven else person.place()
            return moved(spawn, point, yaw_rad, person.speed_mps)
        return spawn

    @property
    def moving(self) -> frozenset[str]:
        """The bodies of the road users that move, or that may start to move."""
        return frozenset(self._vehicles) | frozenset(self._people)

    def _aside_mps(self, body: str) -> float:
        """Speed at which the scripted vehicle changes its lane, to the left."""
        lead = self._start.lead
        if lead is None or lead.body != body or lead.cut_in is None:
            return 0.0
        step_s = 0.01
        return (lateral_m(lead, self._time_s + step_s) - lateral_m(lead, self._time_s)) / step_s

    def _driven(self, spawn: Spawn, s_m: float, aside_m: float, speed_mps: float) -> MovingVehicle:
        return _vehicle(spawn, self._start.path.route, s_m, aside_m, speed_mps, is_driven=True)

    def _free_vehicle(self, spawn: Spawn) -> MovingVehicle:
        """A vehicle with a random route and a random desired speed."""
        lane = self._lanes.lanes[spawn.lane]
        rng = derive_rng(self._seed, "drive", "traffic", spawn.body)
        cruise_mps = lane.speed_mps * float(rng.uniform(0.6, 1.0))
        kind = spawn.actor_type.vehicle
        if kind is not None:
            cruise_mps = min(cruise_mps, kind.cruise_mps)
        length_m = spawn.s_m + lane.speed_mps * self._duration_s + ROOM_M
        route = Route.along(self._lanes, extend_route(self._lanes, spawn.lane, max(1.0, length_m), rng))
        return replace(
            _vehicle(spawn, route, spawn.s_m, spawn.lateral_m, spawn.speed_mps, is_driven=False), cruise_mps=cruise_mps
        )


def lateral_m(lead: LeadStart, time_s: float) -> float:
    """Distance of the scripted vehicle to the left of the ego car's lane, metres; a cosine during the cut-in.

    Args:
        lead: the start of the scripted vehicle.
        time_s: time since the start of the drive.
    """
    if lead.cut_in is None:
        return lead.lateral_m
    begins_s, takes_s = lead.cut_in
    share = float(np.clip((time_s - begins_s) / takes_s, 0.0, 1.0))
    return lead.lateral_m * (1 + math.cos(math.pi * share)) / 2


def _vehicle(
    spawn: Spawn, route: Route, s_m: float, aside_m: float, speed_mps: float, *, is_driven: bool
) -> MovingVehicle:
    return MovingVehicle(
        route=route,
        s_m=s_m,
        lateral_m=aside_m,
        speed_mps=speed_mps,
        cruise_mps=speed_mps,
        front_m=spawn.actor_type.front_m,
        rear_m=spawn.actor_type.rear_m,
        half_width_m=spawn.actor_type.half_width_m,
        is_driven=is_driven,
    )


def _driven_person(walker: WalkerStart) -> MovingPedestrian:
    return MovingPedestrian(
        line=walker.line,
        s_m=0.0,
        lateral_m=0.0,
        direction=1,
        pace_mps=walker.pace_mps,
        speed_mps=0.0,
        beyond_m=0.0,
        is_driven=True,
    )
