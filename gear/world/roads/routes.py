"""Ways through the lane graph, as one line each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.values.geometry import Array
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.polyline import Polyline

HALF_WHEELBASE_SHARE = 0.6
"""Axles stand this share of half a vehicle's length from its middle; its heading is from axle to axle."""

PACE_M = 0.25
"""Way before and after a place over which the speed there is taken."""

BRAKING_WAY_M = 15.0
"""Drivers heed the speed of lanes this far ahead."""


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """Lanes in a row.

    Attributes:
        lanes: their names.
        starts_m: arc length at which each begins.
        speeds_mps: usual on each.
        line: all of them.
        is_dead_end: whether nothing continues the last one.
    """

    lanes: tuple[str, ...]
    starts_m: tuple[float, ...]
    speeds_mps: tuple[float, ...]
    line: Polyline
    is_dead_end: bool

    @staticmethod
    def along(graph: LaneGraph, lanes: tuple[str, ...]) -> Route:
        """Through the lanes given, each a follower of the one before."""
        points: list[Array] = []
        firsts: list[int] = []
        for name in lanes:
            firsts.append(max(0, len(points) - 1))
            for point in graph.lanes[name].line.points_m:
                if not points or float(np.linalg.norm((point - points[-1])[:2])) > 1e-3:
                    points.append(point)
        line = Polyline.through(np.array(points))
        return Route(
            lanes,
            tuple(float(line.s_m[i]) for i in firsts),
            tuple(graph.lanes[name].speed_mps for name in lanes),
            line,
            not graph.lanes[lanes[-1]].next,
        )

    def lane_at(self, s_m: float) -> int:
        """Number of the lane at an arc length."""
        return max(0, int(np.searchsorted(self.starts_m, s_m, side="right")) - 1)

    def speed_at(self, s_m: float) -> float:
        """The lowest usual speed here and where a car that brakes comes to rest."""
        return min(self.speeds_mps[self.lane_at(s_m) : self.lane_at(s_m + BRAKING_WAY_M) + 1])


def extend_route(graph: LaneGraph, lane: str, length_m: float, rng: np.random.Generator) -> tuple[str, ...]:
    """Lanes from the start of `lane` that together have a length, or end where the road does."""
    names = [lane]
    total_m = graph.lanes[lane].line.length_m
    while total_m < length_m and graph.lanes[names[-1]].next:
        followers = graph.lanes[names[-1]].next
        names.append(followers[int(rng.integers(len(followers)))])
        total_m += graph.lanes[names[-1]].line.length_m
    return tuple(names)


def trace_back(
    graph: LaneGraph, lane: str, s_m: float, distance_m: float, rng: np.random.Generator
) -> tuple[tuple[str, ...], float] | None:
    """The place so far before another one: the lanes from it to there, and its arc length on the first of them."""
    names = [lane]
    s_m -= distance_m
    while s_m < 0:
        leaders = graph.previous[names[0]]
        if not leaders:
            return None
        names.insert(0, leaders[int(rng.integers(len(leaders)))])
        s_m += graph.lanes[names[0]].line.length_m
    return tuple(names), s_m


def vehicle_pose(line: Polyline, s_m: float, half_length_m: float, lateral_m: float = 0.0) -> tuple[Array, float]:
    """Where a vehicle stands on a line: the point under its middle, and its heading from axle to axle."""
    reach_m = HALF_WHEELBASE_SHARE * half_length_m
    point, _ = line.at(s_m, lateral_m)
    rear, front = line.at(s_m - reach_m)[0], line.at(s_m + reach_m)[0]
    return point, math.atan2(front[1] - rear[1], front[0] - rear[0])


def offset_left(point_m: Array, yaw_rad: float, lateral_m: float) -> Array:
    """A point to the left of another, by a heading that turns as its owner does.

    By the left of the line's pieces, who moves would jump where two of them meet, and back on the inside of a turn.
    """
    return point_m + lateral_m * np.array([-math.sin(yaw_rad), math.cos(yaw_rad), 0.0])


def moving_pose(line: Polyline, s_m: float, half_length_m: float, lateral_m: float = 0.0) -> tuple[Array, float, float]:
    """As `vehicle_pose`, of one that moves; and its way for each metre of the line, which is less inside a turn."""

    def at(place_m: float) -> tuple[Array, float]:
        point, yaw_rad = vehicle_pose(line, place_m, half_length_m)
        return offset_left(point, yaw_rad, lateral_m), yaw_rad

    (rear, _), (point, yaw_rad), (front, _) = (at(s_m + ahead_m) for ahead_m in (-PACE_M, 0.0, PACE_M))
    return point, yaw_rad, float(np.linalg.norm((front - rear)[:2])) / (2 * PACE_M)
