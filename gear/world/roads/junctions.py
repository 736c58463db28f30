"""Conflicts between lanes in a junction: pairs of lanes that vehicles cannot use at the same time."""

from __future__ import annotations

import numpy as np

from gear.values.geometry import Array
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route

CLEARANCE_M = 2.4
"""Two lanes are in conflict if the distance between their centre lines falls below this value, metres."""


class Junctions:
    """Conflicts between the junction lanes of a town. Each pair of lanes is measured at its first query; the result is
    cached.
    """

    def __init__(self, graph: LaneGraph) -> None:
        """Stores the lane graph of the town; no pair of lanes is measured yet.

        Args:
            graph: the lanes of the town.
        """
        self._graph = graph
        self._conflicts: dict[tuple[str, str], bool] = {}
        self._points: dict[str, Array] = {}

    def crossings(self, route: Route) -> list[tuple[str, float, float]]:
        """The junction lanes of a route, in the order in which the route uses them.

        Args:
            route: the route.

        Returns:
            For each junction lane its name, and the arc lengths on the route, in metres, at which the lane starts and
            ends.
        """
        ends_m = (*route.starts_m[1:], route.line.length_m)
        return [
            (lane, start_m, end_m)
            for lane, start_m, end_m in zip(route.lanes, route.starts_m, ends_m, strict=True)
            if self._graph.lanes[lane].is_junction
        ]

    def conflict(self, first: str, second: str) -> bool:
        """Whether two lanes, given by name, are in conflict: they come nearer to each other than `CLEARANCE_M`.

        Lanes that branch off the same lane are never in conflict, because their vehicles follow each other.

        Args:
            first, second: names of the lanes.
        """
        key = (min(first, second), max(first, second))
        if key not in self._conflicts:
            self._conflicts[key] = self._measure(*key)
        return self._conflicts[key]

    def _measure(self, first: str, second: str) -> bool:
        if first == second or set(self._graph.previous[first]) & set(self._graph.previous[second]):
            return False
        a, b = self._sampled(first), self._sampled(second)
        distances_m = np.linalg.norm(a[:, None, :] - b[None], axis=-1)
        return bool(distances_m.min() < CLEARANCE_M)

    def _sampled(self, lane: str) -> Array:
        if lane not in self._points:
            line = self._graph.lanes[lane].line
            self._points[lane] = line.sample(np.linspace(0.0, line.length_m, max(2, int(line.length_m) + 1)))[0]
        return self._points[lane]
