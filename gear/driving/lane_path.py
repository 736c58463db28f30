"""The known lane of the ego car: the centre line of its route, seen from the car."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.contracts.controllers import Points
from gear.driving.vehicle import VehicleState
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route

AHEAD_M, STEP_M = 80.0, 1.0
"""Length of the path that a controller receives, and the distance of its points, metres."""

SEARCH_M, SEARCH_STEP_M = (-4.0, 10.0), 0.05
"""Arc lengths around the last known position among which the nearest point of the route is searched, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PathPosition:
    """The position of the ego car relative to its route.

    Attributes:
        s_m: arc length on the route.
        lateral_m: distance of the car's middle to the left of the centre line.
        lane_width_m: width of the lane there.
    """

    s_m: float
    lateral_m: float
    lane_width_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LanePath:
    """The centre line of the lanes that the ego car follows.

    Attributes:
        route: the lanes.
        widths_m: width of each lane of the route.
    """

    route: Route
    widths_m: tuple[float, ...]

    @staticmethod
    def along(graph: LaneGraph, lanes: tuple[str, ...]) -> LanePath:
        """Makes the path along connected lanes, given by name.

        Args:
            graph: the lanes of the town.
            lanes: names of the lanes in driving order; each lane leads into the next.
        """
        return LanePath(route=Route.along(graph, lanes), widths_m=tuple(graph.lanes[name].width_m for name in lanes))

    def locate(self, state: VehicleState, near_s_m: float) -> PathPosition:
        """Finds the point of the route that is nearest to the car.

        Args:
            state: the ego car.
            near_s_m: arc length near which the car is, such as its last position.
        """
        arc_m = near_s_m + np.arange(*SEARCH_M, SEARCH_STEP_M)
        points, headings = self.route.line.sample(arc_m)
        offsets_m = np.array([state.x_m, state.y_m]) - points[:, :2]
        index = int(np.argmin((offsets_m**2).sum(axis=1)))
        heading_rad, offset_m = float(headings[index]), offsets_m[index]
        along_m = float(offset_m[0] * math.cos(heading_rad) + offset_m[1] * math.sin(heading_rad))
        aside_m = float(offset_m[1] * math.cos(heading_rad) - offset_m[0] * math.sin(heading_rad))
        s_m = float(arc_m[index]) + along_m
        return PathPosition(s_m=s_m, lateral_m=aside_m, lane_width_m=self.widths_m[self.route.lane_at(s_m)])

    def ahead(self, state: VehicleState, s_m: float) -> Points:
        """The centre line in front of the car, as far as `AHEAD_M`.

        Args:
            state: the ego car.
            s_m: arc length on the route from which on the line is returned.

        Returns:
            (N, 2) points in the ego frame (x forward, y left, metres), `STEP_M` apart.
        """
        points, _ = self.route.line.sample(s_m + np.arange(0.0, AHEAD_M + STEP_M / 2, STEP_M))
        return to_ego(state, points[:, :2])


def to_ego(state: VehicleState, points_m: Points) -> Points:
    """Converts points from world coordinates to the ego frame (origin in the middle of the car, x forward, y left).

    Args:
        state: the ego car.
        points_m: (N, 2) points in world coordinates, metres.

    Returns:
        (N, 2) points in the ego frame, metres.
    """
    c, s = math.cos(state.yaw_rad), math.sin(state.yaw_rad)
    offsets_m = points_m - np.array([state.x_m, state.y_m])
    turned: Points = offsets_m @ np.array([[c, -s], [s, c]])
    return turned
