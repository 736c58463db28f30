"""Routes through the lane graph, and poses of vehicles on them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.values.geometry import Array
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.polyline import Polyline

HALF_WHEELBASE_SHARE = 0.6
"""Distance from a vehicle's middle to an axle, as a share of half its length. The heading of a vehicle is the direction
from the rear axle to the front axle; the two axles lie on the line.
"""

PACE_M = 0.25
"""Distance before and after a position, metres, over which `moving_pose` measures how far the vehicle moves."""

BRAKING_WAY_M = 15.0
"""Distance ahead up to which drivers obey the speed limits of lanes, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Route:
    """A sequence of connected lanes.

    Attributes:
        lanes: names of the lanes.
        starts_m: arc length on the route at which each lane starts.
        speeds_mps: usual speed on each lane.
        line: joint centre line of all lanes.
        is_dead_end: whether no lane continues the last lane.
    """

    lanes: tuple[str, ...]
    starts_m: tuple[float, ...]
    speeds_mps: tuple[float, ...]
    line: Polyline
    is_dead_end: bool

    @staticmethod
    def along(graph: LaneGraph, lanes: tuple[str, ...]) -> Route:
        """Makes the route along the given lanes; each lane must continue the previous lane.

        Args:
            graph: lane graph of the town.
            lanes: names of the lanes in the direction of travel, at least one.
        """
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
        """Index in `lanes` of the lane at an arc length on the route.

        Args:
            s_m: arc length on the route in metres; before its start the first lane counts, after its end the last one.
        """
        return max(0, int(np.searchsorted(self.starts_m, s_m, side="right")) - 1)

    def speed_at(self, s_m: float) -> float:
        """The lowest usual speed, in m/s, on the part of the route that begins at arc length `s_m` (metres) and is
        `BRAKING_WAY_M` long.

        Args:
            s_m: arc length on the route.
        """
        return min(self.speeds_mps[self.lane_at(s_m) : self.lane_at(s_m + BRAKING_WAY_M) + 1])


def extend_route(graph: LaneGraph, lane: str, length_m: float, rng: np.random.Generator) -> tuple[str, ...]:
    """Draws a random route that starts with `lane`, and returns the names of its lanes. The route is at least
    `length_m` long unless the road ends before.

    At each branch the next lane is drawn at random.

    Args:
        graph: the lanes of the town.
        lane: name of the first lane.
        length_m: smallest length of the route.
        rng: random generator.
    """
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
    """Goes back along the lanes from a position. Where several lanes lead into a lane, one of them is drawn at
    random.

    Args:
        graph: lane graph of the town.
        lane: name of the lane of the position.
        s_m: arc length of the position on that lane, metres.
        distance_m: how far to go back.
        rng: random generator.

    Returns:
        Names of the lanes from the new position to the old position, and the arc length of the new position on the
        first lane; None if the road starts less than `distance_m` before the position.
    """
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
    """The position of a vehicle on a line, and its heading: the direction from its rear axle to its front axle,
    which are both on the line.

    Args:
        line: centre line of its lane or route.
        s_m: arc length of its middle.
        half_length_m: half of its length.
        lateral_m: distance of its middle to the left of the line.

    Returns:
        (3,) point under its middle in metres, and heading in radians counter-clockwise from east.
    """
    reach_m = HALF_WHEELBASE_SHARE * half_length_m
    point, _ = line.at(s_m, lateral_m)
    rear, front = line.at(s_m - reach_m)[0], line.at(s_m + reach_m)[0]
    return point, math.atan2(front[1] - rear[1], front[0] - rear[0])


def offset_left(point_m: Array, yaw_rad: float, lateral_m: float) -> Array:
    """Moves a point (3,) to the left of a heading.

    The heading must be that of the road user, which changes steadily. With the heading of a line's segment the point
    would jump where two segments meet, and move backwards on the inside of a turn.

    Args:
        point_m: (3,) point in world coordinates.
        yaw_rad: heading of the road user, counter-clockwise from east.
        lateral_m: distance in metres.

    Returns:
        (3,) the moved point.
    """
    return point_m + lateral_m * np.array([-math.sin(yaw_rad), math.cos(yaw_rad), 0.0])


def moving_pose(line: Polyline, s_m: float, half_length_m: float, lateral_m: float = 0.0) -> tuple[Array, float, float]:
    """The position and heading of a vehicle that moves along a line, and its motion per metre of the line.

    Unlike `vehicle_pose`, the position is moved sideways at a right angle to the heading of the vehicle, so it changes
    steadily from segment to segment.

    Args:
        line: centre line of its lane or route.
        s_m: arc length of its middle, metres.
        half_length_m: half of its length.
        lateral_m: distance of its middle to the left of the line.

    Returns:
        (3,) point under the vehicle's middle in metres, heading in radians counter-clockwise from east, and the
        distance that the middle moves per metre of the line. This distance is less than 1 on the inside of a turn.
    """

    def at(place_m: float) -> tuple[Array, float]:
        point, yaw_rad = vehicle_pose(line, place_m, half_length_m)
        return offset_left(point, yaw_rad, lateral_m), yaw_rad

    (rear, _), (point, yaw_rad), (front, _) = (at(s_m + ahead_m) for ahead_m in (-PACE_M, 0.0, PACE_M))
    return point, yaw_rad, float(np.linalg.norm((front - rear)[:2])) / (2 * PACE_M)
