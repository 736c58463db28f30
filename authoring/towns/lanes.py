"""Lanes: one for every driving lane of every street, and those that lead through the junctions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from authoring.towns import paths
from authoring.towns.network import Network

Array = npt.NDArray[np.float64]
POINT_STEP_M = 2.5
STRAIGHT_RAD = np.radians(35)
U_TURN_RAD = np.radians(150)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lane:
    """One lane: its middle (N, 3) in the direction of travel, and how it joins with others (by name)."""

    name: str
    width_m: float
    speed_mps: float
    points: Array
    following: tuple[str, ...] = ()
    left: str = ""
    right: str = ""
    junction: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """The lanes of one arm of a junction, from the middle of the road outwards.

    Attributes:
        coming: lanes that end at the junction.
        leaving: lanes that start at it.
        away: unit direction (2,) out of the junction.
    """

    coming: tuple[str, ...]
    leaving: tuple[str, ...]
    away: Array


def lane_graph(network: Network) -> dict[str, Lane]:
    """All lanes of a town by name; every one leads on to at least one other."""
    lanes = _street_lanes(network)
    for node in network.nodes:
        approaches = _approaches(network, node)
        for index, approach in enumerate(approaches):
            for other_index, other in enumerate(approaches):
                if index != other_index:
                    for source, target in _pairs(approach, other):
                        lanes |= _connect(lanes, f"{node}_{index}{other_index}", source, target)
    return lanes


def problems(lanes: Mapping[str, Lane], *, max_turn_deg: float = 25.0, max_gap_m: float = 0.01) -> list[str]:
    """Returns the faults of a lane graph, one line each: dead ends, gaps, kinks, lanes that cannot be reached."""
    found = []
    for lane in lanes.values():
        headings = _headings(lane.points)
        if len(lane.points) > 160:
            found.append(f"{lane.name} has {len(lane.points)} points")
        if not lane.following:
            found.append(f"{lane.name} is a dead end")
        turns = [_turn_deg(a, b) for a, b in pairwise(headings)]
        for name in lane.following:
            other = lanes[name]
            turns.append(_turn_deg(headings[-1], _headings(other.points)[0]))
            if np.linalg.norm(other.points[0] - lane.points[-1]) > max_gap_m:
                found.append(f"{lane.name} ends apart from where {name} starts")
            if abs(other.width_m - lane.width_m) > 0.6:
                found.append(f"{lane.name} and {name} differ too much in width")
        if max(turns, default=0.0) > max_turn_deg:
            found.append(f"{lane.name} has a kink of {max(turns):.0f} degrees")
    start = next(iter(lanes))
    forward = {name: set(lane.following) for name, lane in lanes.items()}
    backward = {name: {other for other, lane in lanes.items() if name in lane.following} for name in lanes}
    for word, graph in (("reached from", forward), ("left towards", backward)):
        found += [f"{name} cannot be {word} {start}" for name in sorted(set(lanes) - _reachable(graph, start))]
    return found


def turns_of(lanes: Mapping[str, Lane], name: str) -> set[str]:
    """Which of "left", "straight" and "right" a lane leads to at its end."""
    found = set()
    for following in lanes[name].following:
        headings = _headings(lanes[following].points)
        turn = _signed_turn(headings[0], headings[-1])
        found.add("left" if turn > STRAIGHT_RAD else "right" if turn < -STRAIGHT_RAD else "straight")
    return found


def _street_lanes(network: Network) -> dict[str, Lane]:
    lanes: dict[str, Lane] = {}
    for street in network.streets.values():
        if street.end is None and not street.joins:
            continue
        start_m, end_m = network.span(street.name)
        line = paths.cut(network.lines[street.name], start_m, end_m)
        for forward, count in ((True, street.profile.forward), (False, street.profile.backward)):
            names = [f"{street.name}_{'f' if forward else 'b'}{index}" for index in range(count)]
            for index, name in enumerate(names):
                middle = paths.offset(line, street.profile.lane_offset_m(index, forward=forward))
                heights = network.height_m(street.name, paths.stations(line) + start_m)
                if street.hump_m:
                    dense = paths.densified(line, POINT_STEP_M)
                    middle = paths.offset(dense, street.profile.lane_offset_m(index, forward=forward))
                    heights = network.height_m(street.name, paths.stations(dense) + start_m)
                points = np.column_stack([middle, heights])
                lanes[name] = Lane(
                    name=name,
                    width_m=street.profile.lane_m,
                    speed_mps=street.profile.speed_mps,
                    points=np.round(points if forward else points[::-1], 3),
                    left=names[index - 1] if index else "",
                    right=names[index + 1] if index + 1 < count else "",
                )
    return lanes


def _approaches(network: Network, node: str) -> list[Approach]:
    result = []
    for name, starts, away in network.arms(node):
        street = network.streets[name]
        if street.end is None and not street.joins:
            continue
        forward = tuple(f"{name}_f{index}" for index in range(street.profile.forward))
        backward = tuple(f"{name}_b{index}" for index in range(street.profile.backward))
        coming, leaving = (backward, forward) if starts else (forward, backward)
        result.append(Approach(coming, leaving, away))
    return result


def _pairs(source: Approach, target: Approach) -> list[tuple[str, str]]:
    """Pairs of connected lanes: inner lanes turn left, outer lanes turn right, all lanes lead straight ahead."""
    if not source.coming or not target.leaving:
        return []
    turn = _signed_turn(-source.away, target.away)
    if abs(turn) > U_TURN_RAD:
        return []
    if turn > STRAIGHT_RAD:
        return [(source.coming[0], target.leaving[0])]
    if turn < -STRAIGHT_RAD:
        return [(source.coming[-1], target.leaving[-1])]
    last = len(target.leaving) - 1
    pairs = [(lane, target.leaving[min(index, last)]) for index, lane in enumerate(source.coming)]
    if len(source.coming) < len(target.leaving):
        pairs += [(source.coming[-1], lane) for lane in target.leaving[len(source.coming) :]]
    return pairs


def _connect(lanes: Mapping[str, Lane], name: str, source_name: str, target_name: str) -> dict[str, Lane]:
    source, target = lanes[source_name], lanes[target_name]
    lane_name = f"{name}_{source_name.rsplit('_', 1)[1]}{target_name.rsplit('_', 1)[1]}"
    middle = paths.blend(
        source.points[-1, :2], _headings(source.points)[-1], target.points[0, :2], _headings(target.points)[0]
    )
    points = np.column_stack([middle, np.zeros(len(middle))])
    points[0], points[-1] = source.points[-1], target.points[0]
    rounded = np.round(points, 3).astype(np.float64)
    joint = Lane(
        name=lane_name,
        width_m=min(source.width_m, target.width_m),
        speed_mps=min(source.speed_mps, target.speed_mps, 7.0),
        points=rounded,
        following=(target_name,),
        junction=True,
    )
    return {source_name: replace(source, following=(*source.following, lane_name)), lane_name: joint}


def _headings(points: Array) -> Array:
    steps = np.diff(points[:, :2], axis=0)
    unit: Array = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    return unit


def _signed_turn(a: Array, b: Array) -> float:
    return float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))


def _turn_deg(a: Array, b: Array) -> float:
    return float(np.degrees(abs(_signed_turn(a, b))))


def _reachable(graph: Mapping[str, set[str]], start: str) -> set[str]:
    seen, queue = {start}, [start]
    while queue:
        for name in sorted(graph[queue.pop()] - seen):
            seen.add(name)
            queue.append(name)
    return seen
