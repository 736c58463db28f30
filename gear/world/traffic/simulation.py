"""Traffic through time: vehicles follow their routes by the intelligent driver model, people walk.

Vehicles keep their distance to whatever stands or moves in the strip ahead of them, give way where lanes of a junction
cross, and stop where the road ends. Nothing here is random: the same start gives the same traffic.
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
"""People look this far ahead before they take a step."""

TURNING_M = 1.5
"""Way before and after a corner in which people turn, for each metre beside the line, of which there is one at least:
nobody steps back at a right angle, on its inside either.
"""

PERSON_FORESIGHT_S = (0.0, 0.7, 1.4)
"""Drivers see people where they are and where they will be."""

HARDEST_SLOWING = 2.5
"""Nobody brakes hard only for being too fast: the model's term for that goes no further."""

ACCELERATION_MPS2, BRAKING_MPS2, HARDEST_MPS2 = 1.6, 2.0, 8.0
STANDSTILL_GAP_M, HEADWAY_S = 2.0, 1.2
GIVE_WAY_M = 25.0
"""Drivers this near to a junction ask for their way through it."""


@dataclass(slots=True, eq=False, kw_only=True)
class MovingVehicle:
    """A vehicle under way.

    Attributes:
        route, s_m, lateral_m: where it is going, and where it is on it.
        speed_mps, cruise_mps: now, and on a free road.
        front_m, rear_m, half_width_m: of the vehicle, from its middle.
    """

    route: Route
    s_m: float
    lateral_m: float
    speed_mps: float
    cruise_mps: float
    front_m: float
    rear_m: float
    half_width_m: float


@dataclass(slots=True, eq=False, kw_only=True)
class MovingPedestrian:
    """A person under way.

    Attributes:
        line, s_m, lateral_m: sidewalk or crossing, and where on it.
        direction: 1 along the line, -1 against it.
        pace_mps, speed_mps: unhindered, and now.
        beyond_m: how far past the end of the line the walk goes on, off a road; negative for stopping before.
    """

    line: Polyline
    s_m: float
    lateral_m: float
    direction: int
    pace_mps: float
    speed_mps: float
    beyond_m: float

    @property
    def is_at_end(self) -> bool:
        """Whether the walk ends here."""
        left_m = self.line.length_m - self.s_m if self.direction > 0 else self.s_m
        return left_m < -self.beyond_m

    def place(self) -> tuple[Array, float]:
        """Point on the ground and heading, under way."""
        heading_rad = self.line.heading(self.s_m, TURNING_M * max(1.0, abs(self.lateral_m)))
        point = offset_left(self.line.at(self.s_m)[0], heading_rad, self.lateral_m)
        return point, heading_rad if self.direction > 0 else heading_rad + math.pi

    def first_place(self) -> tuple[Array, float]:
        """The same in a picture without a before and after."""
        point, heading_rad = self.line.at(self.s_m, self.lateral_m)
        return point, heading_rad if self.direction > 0 else heading_rad + math.pi


@dataclass(frozen=True, slots=True, eq=False)
class Discs:
    """What stands in the way, as discs.

    Attributes:
        centres_m: (N, 3).
        radii_m: (N,).
        velocities_mps: (N, 2).
        owners: (N,) index of the driver, -1 for others.
    """

    centres_m: Array
    radii_m: Array
    velocities_mps: Array
    owners: Array


def vehicle_discs(
    point_m: Array, heading_rad: float, front_m: float, rear_m: float, half_width_m: float
) -> list[tuple[float, float, float, float]]:
    """Discs (x, y, z, radius) that cover a vehicle."""
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
    """Drivers and walkers among things that stand still."""

    def __init__(
        self,
        drivers: Sequence[MovingVehicle],
        walkers: Sequence[MovingPedestrian],
        grounded: Sequence[tuple[float, float, float, float]],
        junctions: Junctions,
    ) -> None:
        """Takes the moving by reference and moves them; `grounded` are discs (x, y, z, radius)."""
        self.drivers = list(drivers)
        self.walkers = list(walkers)
        self._standing = list(grounded)
        self._junctions = junctions
        for index, driver in enumerate(self.drivers):
            gap_m, _ = self._gap(index, self._discs())
            brakeable_mps = math.sqrt(2 * BRAKING_MPS2 * max(0.0, gap_m - STANDSTILL_GAP_M))
            driver.speed_mps = min(driver.speed_mps, driver.cruise_mps, brakeable_mps)

    def advance(self, duration_s: float) -> None:
        """Moves everybody on in time."""
        steps = max(1, math.ceil(duration_s / MAX_STEP_S - 1e-9))
        for _ in range(steps):
            self._step(duration_s / steps)

    def _step(self, step_s: float) -> None:
        discs = self._discs()
        stops = self._stop_lines()
        accelerations = [self._acceleration(index, discs, stops[index]) for index in range(len(self.drivers))]
        walking = self._free_walkers(discs)
        for driver, acceleration in zip(self.drivers, accelerations, strict=True):
            driver.speed_mps = max(0.0, driver.speed_mps + acceleration * step_s)
            driver.s_m += driver.speed_mps * step_s
        for walker, is_free in zip(self.walkers, walking, strict=True):
            walker.speed_mps = walker.pace_mps if is_free else 0.0
            walker.s_m += walker.direction * walker.speed_mps * step_s

    def _acceleration(self, index: int, discs: Discs, stop_m: float) -> float:
        """By the intelligent driver model."""
        driver = self.drivers[index]
        gap_m, leader_mps = self._gap(index, discs)
        if stop_m < gap_m:
            gap_m, leader_mps = stop_m, 0.0
        speed_mps = driver.speed_mps
        closing = speed_mps * (speed_mps - leader_mps) / (2 * math.sqrt(ACCELERATION_MPS2 * BRAKING_MPS2))
        wanted_m = STANDSTILL_GAP_M + max(0.0, speed_mps * HEADWAY_S + closing)
        cruise_mps = min(driver.cruise_mps, driver.route.speed_at(driver.s_m))
        free = min(HARDEST_SLOWING, (speed_mps / max(cruise_mps, 0.1)) ** 4)
        acceleration = ACCELERATION_MPS2 * (1 - free - (wanted_m / max(gap_m, 0.1)) ** 2)
        return max(-HARDEST_MPS2, acceleration)

    def _gap(self, index: int, discs: Discs) -> tuple[float, float]:
        """Free way ahead of a driver's front, and the speed of what ends it."""
        driver = self.drivers[index]
        front_s_m = driver.s_m + driver.front_m
        gap_m = driver.route.line.length_m - front_s_m if driver.route.is_dead_end else math.inf
        others = discs.owners != index
        if not others.any():
            return gap_m, 0.0
        ahead_m = np.arange(0.0, LOOK_AHEAD_M, STRIP_STEP_M)
        strip_m, headings = driver.route.line.sample(front_s_m + ahead_m, driver.lateral_m)
        centres_m, radii_m = discs.centres_m[others], discs.radii_m[others]
        offsets = strip_m[:, None, :] - centres_m[None]
        near = np.hypot(offsets[..., 0], offsets[..., 1]) < radii_m + driver.half_width_m + SIDE_MARGIN_M
        near &= np.abs(offsets[..., 2]) < LEVEL_M
        # What touches the strip only beside the car's own front is beside it, not ahead of it.
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
        """How far ahead each driver must stop to give way; infinite where it need not."""
        claims: list[tuple[float, int, str]] = []
        for index, driver in enumerate(self.drivers):
            rear_m, front_m = driver.s_m - driver.rear_m, driver.s_m + driver.front_m
            for lane, start_m, end_m in self._junctions.crossings(driver.route):
                if end_m > rear_m and start_m - front_m < GIVE_WAY_M:
                    claims.append((max(0.0, start_m - front_m), index, lane))
        stops = [math.inf] * len(self.drivers)
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

    def _free_walkers(self, discs: Discs) -> list[bool]:
        """Who may take a step: nothing in the way, and not at the end of the walk."""
        if not self.walkers:
            return []
        places = [walker.place() for walker in self.walkers]
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
        return [bool(ok) and not walker.is_at_end for ok, walker in zip(free, self.walkers, strict=True)]

    def _discs(self) -> Discs:
        """Owners: drivers by number, -1 for what stands still, -2 for people."""
        rows: list[tuple[float, float, float, float, float, float, float]] = []
        rows += [(x, y, z, radius, 0.0, 0.0, -1.0) for x, y, z, radius in self._standing]
        for index, driver in enumerate(self.drivers):
            point, heading_rad = driver.route.line.at(driver.s_m, driver.lateral_m)
            vx, vy = driver.speed_mps * math.cos(heading_rad), driver.speed_mps * math.sin(heading_rad)
            discs = vehicle_discs(point, heading_rad, driver.front_m, driver.rear_m, driver.half_width_m)
            rows += [(*disc, vx, vy, float(index)) for disc in discs]
        for walker in self.walkers:
            point, heading_rad = walker.place()
            vx, vy = walker.pace_mps * math.cos(heading_rad), walker.pace_mps * math.sin(heading_rad)
            for ahead_s in PERSON_FORESIGHT_S:
                x, y = float(point[0]) + vx * ahead_s, float(point[1]) + vy * ahead_s
                rows.append((x, y, float(point[2]), PERSON_RADIUS_M, vx, vy, -2.0))
        table = np.array(rows).reshape(-1, 7)
        return Discs(table[:, :3], table[:, 3], table[:, 4:6], table[:, 6])
