"""Simulates traffic: vehicles follow their routes by the intelligent driver model, people walk.

The model is that of Treiber, Hennecke and Helbing, "Congested traffic states in empirical observations and microscopic
simulations" (2000). Vehicles keep their distance to all objects in the strip of road in front of them, give way where
lanes of a junction are in conflict, and stop at the end of a road. The simulation is deterministic: the same start
gives the same traffic.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gear.values.geometry import Array
from gear.world.roads.junctions import Junctions
from gear.world.roads.polyline import Polyline
from gear.world.roads.routes import Route, offset_left
from gear.world.traffic.footprints import LEVEL_M

MAX_STEP_S = 0.05
LOOK_AHEAD_M = 40.0
STRIP_STEP_M = 1.0
SIDE_MARGIN_M = 0.25
PERSON_RADIUS_M = 0.35
PERSON_REACH_M = 0.9
"""A person takes a step if there is no obstacle within this distance in front, metres."""

TURNING_M = 1.5
"""Distance before and after a corner of a walk over which people turn, metres. It is multiplied by the distance of a
person from the line in metres, if this is above 1. Over a shorter distance, people on the inside of the corner would
move backwards.
"""

PERSON_FORESIGHT_S = (0.0, 0.7, 1.4)
"""Vehicles stay clear of people's current positions and of their positions after these times, seconds."""

HARDEST_SLOWING = 2.5
"""Upper bound of the speed term of the intelligent driver model. A vehicle above its cruising speed on a free road
therefore brakes gently.
"""

ACCELERATION_MPS2, BRAKING_MPS2, HARDEST_MPS2 = 1.6, 2.0, 8.0
STANDSTILL_GAP_M, HEADWAY_S = 2.0, 1.2
GIVE_WAY_M = 25.0
"""Distance to a junction, metres, below which a vehicle reserves its lane through the junction."""


@dataclass(slots=True, eq=False, kw_only=True)
class MovingVehicle:
    """A vehicle in motion.

    Attributes:
        route: the lanes that the vehicle follows.
        s_m, lateral_m: arc length of its middle on the route, and its distance to the left of the route.
        speed_mps: current speed.
        cruise_mps: desired speed on a free road.
        front_m, rear_m, half_width_m: distances of its front, rear and sides from its middle.
        is_driven: whether the caller moves it, as the ego car of a closed loop; the other road users react to it, and
            it has priority in junctions.
    """

    route: Route
    s_m: float
    lateral_m: float
    speed_mps: float
    cruise_mps: float
    front_m: float
    rear_m: float
    half_width_m: float
    is_driven: bool = False


@dataclass(slots=True, eq=False, kw_only=True)
class MovingPedestrian:
    """A person in motion.

    Attributes:
        line: centre line of the sidewalk or crosswalk.
        s_m, lateral_m: arc length on the line, and distance to the left of the line.
        direction: 1 for walking along the line, -1 for walking against it.
        pace_mps: walking speed without obstacles.
        speed_mps: current speed.
        beyond_m: how far the person walks past the end of the line; negative to stop before the end.
        is_driven: whether the caller moves the person; the other road users react to the person.
    """

    line: Polyline
    s_m: float
    lateral_m: float
    direction: int
    pace_mps: float
    speed_mps: float
    beyond_m: float
    is_driven: bool = False

    @property
    def is_at_end(self) -> bool:
        """Whether the person has reached the end of the walk."""
        left_m = self.line.length_m - self.s_m if self.direction > 0 else self.s_m
        return left_m < -self.beyond_m

    def place(self) -> tuple[Array, float]:
        """The position of a person in motion: (3,) point on the ground and heading in radians, which changes
        steadily around corners.

        Returns:
            The point in world coordinates, and the direction in which the person walks, counter-clockwise from east.
        """
        heading_rad = self.line.heading(self.s_m, TURNING_M * max(1.0, abs(self.lateral_m)))
        point = offset_left(self.line.at(self.s_m)[0], heading_rad, self.lateral_m)
        return point, heading_rad if self.direction > 0 else heading_rad + math.pi

    def first_place(self) -> tuple[Array, float]:
        """The position of a person in a single picture: (3,) point on the ground and heading in radians. The
        heading is that of the line's segment.

        Returns:
            The point in world coordinates, and the direction in which the person walks, counter-clockwise from east.
        """
        point, heading_rad = self.line.at(self.s_m, self.lateral_m)
        return point, heading_rad if self.direction > 0 else heading_rad + math.pi


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """Obstacles for the traffic, each covered by discs on the ground.

    Attributes:
        centres_m: (N, 3) middles of the discs, world coordinates.
        radii_m: (N,) radii.
        velocities_mps: (N, 2) velocities, m/s.
        owners: (N,) index of the vehicle to which a disc belongs; -1 for static objects, -2 for people.
    """

    centres_m: Array
    radii_m: Array
    velocities_mps: Array
    owners: Array


def vehicle_discs(
    point_m: Array, heading_rad: float, front_m: float, rear_m: float, half_width_m: float
) -> list[tuple[float, float, float, float]]:
    """Discs on the ground that together cover a vehicle.

    Args:
        point_m: (3,) point under its middle.
        heading_rad: its heading, counter-clockwise from east.
        front_m, rear_m, half_width_m: distances of its front, rear and sides from its middle.

    Returns:
        (x, y, z, radius) of each disc, in metres.
    """
    length_m = front_m + rear_m
    count = max(1, math.ceil(length_m / (1.5 * half_width_m)))
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    discs = []
    for number in range(count):
        ahead_m = -rear_m + length_m * (number + 0.5) / count
        reach_m = math.hypot(length_m / count / 2, half_width_m)
        discs.append((float(point_m[0] + c * ahead_m), float(point_m[1] + s * ahead_m), float(point_m[2]), reach_m))
    return discs


class TrafficSimulation:
    """Simulates the traffic of a sample: vehicles and people that move among static obstacles."""

    def __init__(
        self,
        vehicles: Sequence[MovingVehicle],
        people: Sequence[MovingPedestrian],
        obstacles: Sequence[tuple[float, float, float, float]],
        junctions: Junctions,
    ) -> None:
        """Prepares a simulation. Vehicles that are too fast to brake in time for an obstacle in front are slowed down.

        Args:
            vehicles, people: the road users, changed in place.
            obstacles: static obstacles as discs (x, y, z, radius) in metres.
            junctions: conflicts between the junction lanes of the town.
        """
        self.vehicles = list(vehicles)
        self.people = list(people)
        self._obstacles = list(obstacles)
        self._junctions = junctions
        for index, vehicle in enumerate(self.vehicles):
            if vehicle.is_driven:
                continue
            gap_m, _ = self._gap(index, self._discs())
            brakeable_mps = math.sqrt(2 * BRAKING_MPS2 * max(0.0, gap_m - STANDSTILL_GAP_M))
            vehicle.speed_mps = min(vehicle.speed_mps, vehicle.cruise_mps, brakeable_mps)

    def advance(self, duration_s: float) -> None:
        """Moves all road users, except those that the caller moves, by a time span, in steps of at most
        `MAX_STEP_S`.

        Args:
            duration_s: the time span in seconds.
        """
        steps = max(1, math.ceil(duration_s / MAX_STEP_S - 1e-9))
        for _ in range(steps):
            self._step(duration_s / steps)

    def _step(self, step_s: float) -> None:
        discs = self._discs()
        stops = self._stop_lines()
        accelerations = [
            0.0 if vehicle.is_driven else self._acceleration(index, discs, stops[index])
            for index, vehicle in enumerate(self.vehicles)
        ]
        steps_allowed = self._free_to_step(discs)
        for vehicle, acceleration in zip(self.vehicles, accelerations, strict=True):
            if vehicle.is_driven:
                continue
            vehicle.speed_mps = max(0.0, vehicle.speed_mps + acceleration * step_s)
            vehicle.s_m += vehicle.speed_mps * step_s
        for person, is_free in zip(self.people, steps_allowed, strict=True):
            if person.is_driven:
                continue
            person.speed_mps = person.pace_mps if is_free else 0.0
            person.s_m += person.direction * person.speed_mps * step_s

    def _acceleration(self, index: int, discs: Discs, stop_m: float) -> float:
        """Acceleration of a vehicle in m/s², by the intelligent driver model; `stop_m` is the distance to its
        stop line.
        """
        vehicle = self.vehicles[index]
        gap_m, leader_mps = self._gap(index, discs)
        if stop_m < gap_m:
            gap_m, leader_mps = stop_m, 0.0
        speed_mps = vehicle.speed_mps
        closing = speed_mps * (speed_mps - leader_mps) / (2 * math.sqrt(ACCELERATION_MPS2 * BRAKING_MPS2))
        wanted_m = STANDSTILL_GAP_M + max(0.0, speed_mps * HEADWAY_S + closing)
        cruise_mps = min(vehicle.cruise_mps, vehicle.route.speed_at(vehicle.s_m))
        free = min(HARDEST_SLOWING, (speed_mps / max(cruise_mps, 0.1)) ** 4)
        acceleration = ACCELERATION_MPS2 * (1 - free - (wanted_m / max(gap_m, 0.1)) ** 2)
        return max(-HARDEST_MPS2, acceleration)

    def _gap(self, index: int, discs: Discs) -> tuple[float, float]:
        """Free distance in front of a vehicle, and the speed in m/s of the object at its end."""
        vehicle = self.vehicles[index]
        front_s_m = vehicle.s_m + vehicle.front_m
        gap_m = vehicle.route.line.length_m - front_s_m if vehicle.route.is_dead_end else math.inf
        others = discs.owners != index
        if not others.any():
            return gap_m, 0.0
        ahead_m = np.arange(0.0, LOOK_AHEAD_M, STRIP_STEP_M)
        strip_m, headings = vehicle.route.line.sample(front_s_m + ahead_m, vehicle.lateral_m)
        centres_m, radii_m = discs.centres_m[others], discs.radii_m[others]
        offsets = strip_m[:, None, :] - centres_m[None]
        near = np.hypot(offsets[..., 0], offsets[..., 1]) < radii_m + vehicle.half_width_m + SIDE_MARGIN_M
        near &= np.abs(offsets[..., 2]) < LEVEL_M
        # An object that touches the strip only beside the front of the vehicle is not ahead of it.
        offset_left = (offsets[0, :, 0] * np.cos(headings[0]) + offsets[0, :, 1] * np.sin(headings[0])) > 0
        near &= ~offset_left
        hits = near.any(axis=1)
        if not hits.any():
            return gap_m, 0.0
        first = int(np.argmax(hits))
        if ahead_m[first] >= gap_m:
            return gap_m, 0.0
        heading = np.array([np.cos(headings[first]), np.sin(headings[first])])
        speeds = discs.velocities_mps[others][near[first]] @ heading
        return float(ahead_m[first]), max(0.0, float(speeds.min()))

    def _stop_lines(self) -> list[float]:
        """For each vehicle: the distance ahead at which it must stop to give way; infinite if it need not stop."""
        claims: list[tuple[float, int, str]] = []
        for index, vehicle in enumerate(self.vehicles):
            rear_m, front_m = vehicle.s_m - vehicle.rear_m, vehicle.s_m + vehicle.front_m
            for lane, start_m, end_m in self._junctions.crossings(vehicle.route):
                if end_m > rear_m and start_m - front_m < GIVE_WAY_M:
                    distance_m = max(0.0, start_m - front_m)
                    # A vehicle inside the junction goes first, then one that the caller moves, then the nearest.
                    claims.append((distance_m if not vehicle.is_driven else min(distance_m, 1e-6), index, lane))
        stops = [math.inf] * len(self.vehicles)
        granted: list[tuple[int, str]] = []
        for distance_m, index, lane in sorted(claims):
            blocked = any(
                other != index and self._junctions.conflict(lane, other_lane) for other, other_lane in granted
            )
            if blocked and distance_m > 0:
                stops[index] = min(stops[index], distance_m)
            else:
                granted.append((index, lane))
        return stops

    def _free_to_step(self, discs: Discs) -> list[bool]:
        """For each person: True if nothing is in the way and the end of the walk is not reached."""
        if not self.people:
            return []
        places = [person.place() for person in self.people]
        points_m = np.array([point[:2] for point, _ in places])
        headings = np.array([[math.cos(heading), math.sin(heading)] for _, heading in places])
        ahead_m = points_m + PERSON_REACH_M * headings
        between_m = np.linalg.norm(ahead_m[:, None] - points_m[None], axis=-1)
        np.fill_diagonal(between_m, np.inf)
        free = between_m.min(axis=1) >= 2 * PERSON_RADIUS_M
        things = discs.owners >= -1
        if things.any():
            distances_m = np.linalg.norm(ahead_m[:, None] - discs.centres_m[None, things, :2], axis=-1)
            free &= (distances_m >= discs.radii_m[things] + PERSON_RADIUS_M).all(axis=1)
        return [bool(ok) and not person.is_at_end for ok, person in zip(free, self.people, strict=True)]

    def _discs(self) -> Discs:
        """Discs of all obstacles, vehicles and people, with the owners that `Discs` describes."""
        rows: list[tuple[float, float, float, float, float, float, float]] = []
        rows += [(x, y, z, radius, 0.0, 0.0, -1.0) for x, y, z, radius in self._obstacles]
        for index, vehicle in enumerate(self.vehicles):
            point, heading_rad = vehicle.route.line.at(vehicle.s_m, vehicle.lateral_m)
            vx, vy = vehicle.speed_mps * math.cos(heading_rad), vehicle.speed_mps * math.sin(heading_rad)
            discs = vehicle_discs(point, heading_rad, vehicle.front_m, vehicle.rear_m, vehicle.half_width_m)
            rows += [(*disc, vx, vy, float(index)) for disc in discs]
        for person in self.people:
            point, heading_rad = person.place()
            pace_mps = person.speed_mps if person.is_driven else person.pace_mps
            vx, vy = pace_mps * math.cos(heading_rad), pace_mps * math.sin(heading_rad)
            for ahead_s in PERSON_FORESIGHT_S:
                x, y = float(point[0]) + vx * ahead_s, float(point[1]) + vy * ahead_s
                rows.append((x, y, float(point[2]), PERSON_RADIUS_M, vx, vy, -2.0))
        table = np.array(rows).reshape(-1, 7)
        return Discs(table[:, :3], table[:, 3], table[:, 4:6], table[:, 6])
