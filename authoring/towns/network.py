"""The street network: junctions, streets with their cross-sections, and where a street meets a junction."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from authoring.towns import paths

Array = npt.NDArray[np.float64]
Control = Literal["signals", "stop", "yield"]
CORNER_RADIUS_M = 6.0
GUTTER_M = 0.3
BAY_M = (5.8, 2.3)
CROSSING_M = 3.0
STOP_LINE_GAP_M = 1.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """A street's cross-section; left and right as seen along the street.

    Attributes:
        forward, backward: lanes in and against the direction of the street.
        lane_m: width of a lane.
        median_m: width of a raised strip between the directions, 0 for paint.
        sidewalk_m: width of the sidewalk on either side.
        speed_mps: speed limit.
    """

    forward: int = 1
    backward: int = 1
    lane_m: float = 3.5
    median_m: float = 0.0
    sidewalk_m: float = 4.0
    speed_mps: float = 11.1

    @property
    def one_way(self) -> bool:
        """Whether all lanes run the same way, along the street or against it."""
        return not (self.forward and self.backward)

    @property
    def axis_m(self) -> float:
        """How far left of the street's line the two directions meet."""
        return 0.0 if not self.one_way else (self.forward - self.backward) * self.lane_m / 2

    @property
    def half_width_m(self) -> float:
        """From the street's line to either kerb, without parking bays."""
        lanes = self.forward + self.backward if self.one_way else 2 * max(self.forward, self.backward)
        return lanes * self.lane_m / 2 + self.median_m / 2 + GUTTER_M

    def lane_offset_m(self, index: int, *, forward: bool) -> float:
        """How far left of the street's line a lane's middle runs; index 0 is next to the axis."""
        away = self.median_m / 2 + (index + 0.5) * self.lane_m
        return self.axis_m - away if forward else self.axis_m + away


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A junction."""

    name: str
    position: tuple[float, float]
    control: Control = "yield"


@dataclass(frozen=True, kw_only=True)
class Street:
    """A street between two junctions, or from a junction out of town.

    Attributes:
        start, end: names of junctions; `end` is None for a street out of the town, which has no lanes.
        corners: inner corners of its line with the radius of each curve.
        leaves_to: where a street without an end junction ends.
        bays_left, bays_right: whether there are parking bays along it.
        joins: whether a street without an end junction has lanes, which others continue where it ends.
        hump_m: height of its bridge, 0 for a level street.
        ramp_m, deck_half_m: length of the bridge's ramps, and half the length of what lies between them.
        trees_m: spacing of street trees, 0 for none.
        crossings: where people cross at lights between its junctions, as shares of its line.
    """

    name: str
    start: str
    end: str | None = None
    profile: Profile = field(default_factory=Profile)
    corners: Sequence[tuple[float, float, float]] = ()
    leaves_to: tuple[float, float] | None = None
    bays_left: bool = False
    bays_right: bool = False
    joins: bool = False
    hump_m: float = 0.0
    ramp_m: float = 26.0
    deck_half_m: float = 11.0
    trees_m: float = 0.0
    crossings: Sequence[float] = ()


@dataclass(frozen=True)
class Network:
    """Junctions and streets with everything about them that needs arithmetic."""

    nodes: Mapping[str, Node]
    streets: Mapping[str, Street]

    @cached_property
    def lines(self) -> dict[str, Array]:
        """Each street's line (N, 2) from junction centre to junction centre."""
        result = {}
        for street in self.streets.values():
            end = self.nodes[street.end].position if street.end else street.leaves_to
            if end is None:
                raise ValueError(f"street {street.name} has neither an end junction nor a place it leaves to")
            corners = [self.nodes[street.start].position, *[(x, y) for x, y, _ in street.corners], end]
            result[street.name] = paths.filleted(corners, [radius for *_, radius in street.corners])
        return result

    def arms(self, node: str) -> list[tuple[str, bool, Array]]:
        """The streets of a junction, counter-clockwise: (name, whether it starts here, unit direction away)."""
        found = []
        for street in self.streets.values():
            line = self.lines[street.name]
            if street.start == node:
                found.append((street.name, True, (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])))
            if street.end == node:
                found.append((street.name, False, (line[-2] - line[-1]) / np.linalg.norm(line[-2] - line[-1])))
        return sorted(found, key=lambda arm: float(np.arctan2(arm[2][1], arm[2][0])))

    @cached_property
    def mouths(self) -> dict[tuple[str, bool], float]:
        """Metres from a junction's centre to a street's stop line, by (street, whether it starts there)."""
        result: dict[tuple[str, bool], float] = {}
        for node in self.nodes:
            arms = self.arms(node)
            corner = dict.fromkeys([arm[:2] for arm in arms], 0.0)
            for arm, following in zip(arms, arms[1:] + arms[:1], strict=True):
                near, far = self._corner(arm, following)
                corner[arm[:2]] = max(corner[arm[:2]], near)
                corner[following[:2]] = max(corner[following[:2]], far)
            for arm in arms:
                result[arm[:2]] = corner[arm[:2]] + 0.6 + CROSSING_M + STOP_LINE_GAP_M
        return result

    def _corner(self, arm: tuple[str, bool, Array], following: tuple[str, bool, Array]) -> tuple[float, float]:
        """How far the rounded corner between two neighbouring arms reaches along each of them."""
        angle = float(np.arctan2(arm[2][1], arm[2][0])), float(np.arctan2(following[2][1], following[2][0]))
        between = (angle[1] - angle[0]) % (2 * np.pi)
        if between > np.radians(165):
            return 0.0, 0.0
        left, right = (self.streets[name].profile.half_width_m for name in (arm[0], following[0]))
        fillet = CORNER_RADIUS_M / np.tan(between / 2)
        cos, sin = np.cos(between), np.sin(between)
        return (right + left * cos) / sin + fillet, (left + right * cos) / sin + fillet

    def span(self, street: str) -> tuple[float, float]:
        """From which to which distance along its line a street is a street and not a junction."""
        line_m = paths.length(self.lines[street])
        end_m = line_m - self.mouths[street, False] if self.streets[street].end else line_m
        return self.mouths[street, True], end_m

    def crossings_m(self, street: str) -> list[float]:
        """The distances along a street's line of the middles of its crossings between junctions."""
        return [share * paths.length(self.lines[street]) for share in self.streets[street].crossings]

    def height_m(self, street: str, station_m: npt.ArrayLike) -> Array:
        """Height of a street's surface at distances along its line: 0 save on a bridge."""
        along = np.asarray(station_m, np.float64)
        hump = self.streets[street].hump_m
        start, end = self.ramp(street)
        half = (end - start) / 2
        share = np.clip((half - np.abs(along - start - half)) / self.streets[street].ramp_m, 0, 1)
        return np.asarray(hump * share * share * (3 - 2 * share))

    def ramp(self, street: str) -> tuple[float, float]:
        """The distances along a bridge's street between which it is not level."""
        middle = paths.length(self.lines[street]) / 2
        reach = self.streets[street].deck_half_m + self.streets[street].ramp_m
        return middle - reach, middle + reach
