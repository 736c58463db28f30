"""Checks of a town's lanes, walks and parking bays. Each function returns the problems that it finds, one line each."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gear.testing.town_facts import DOWN, RAY_START_M, Rays, TownUnderTest
from gear.values.geometry import Array, wrap_angle_rad
from gear.world.assets.geom_classes import unprefixed_class
from gear.world.roads.lanes import Lane, LaneGraph, ParkingBay
from gear.world.roads.polyline import Polyline

STEP_M = 2.0
BUMPER_M = 0.6
"""Height of the rays to obstacles in parking bays."""

KERB_M = 0.2
"""Height of a kerb that a wheel may climb in the tight turn of a junction."""

DRIVABLE = frozenset({"road", "road_marking", "parking", "ground", "bridge", "static"})
"""Labels of the surfaces below a car; `static` for manholes and rails."""

CROSSWALK_REACH_M = 3.0
"""Largest distance of a crosswalk's end from the edge of a sidewalk."""


def dead_ends(graph: LaneGraph, open_ends: frozenset[str], join_m: float) -> list[str]:
    """One line for each lane that no lane continues, and for each gap between a lane and the lane that continues it.

    Lanes in `open_ends` may end; a name in `open_ends` that is not such a lane is a problem too.

    Args:
        graph: lanes, walks and parking bays of the town.
        open_ends: names of lanes that may end.
        join_m: largest allowed gap.
    """
    problems = [
        f"{lane.name} is a dead end at {_place(lane.line.points_m[-1])}: nothing in its next="
        for lane in graph.lanes.values()
        if not lane.next and lane.name not in open_ends
    ]
    problems += [f"{name} is in open_ends, but is no lane without next=" for name in sorted(open_ends)
                 if name not in graph.lanes or graph.lanes[name].next]  # fmt: skip
    for lane in graph.lanes.values():
        for name in lane.next:
            gap_m = float(np.linalg.norm(graph.lanes[name].line.points_m[0] - lane.line.points_m[-1]))
            if gap_m > join_m:
                problems.append(f"{lane.name} ends {gap_m:.2f} m from where its follower {name} starts")
    return problems


def kinks(graph: LaneGraph, most_deg: float) -> list[str]:
    """One line for each point at which the heading jumps by more than `most_deg`, inside or at the end of a lane.

    Args:
        graph: lanes of the town.
        most_deg: largest allowed turn at one point, degrees.
    """
    problems = []
    for lane in graph.lanes.values():
        turns_deg = np.degrees(np.abs([wrap_angle_rad(float(t)) for t in np.diff(_headings(lane.line))]))
        for index in np.flatnonzero(turns_deg > most_deg):
            place = _place(lane.line.points_m[index + 1])
            problems.append(f"{lane.name} turns by {turns_deg[index]:.0f} deg at one point, {place}")
        for name in lane.next:
            into = float(_headings(graph.lanes[name].line)[0] - _headings(lane.line)[-1])
            turn_deg = math.degrees(abs(wrap_angle_rad(into)))
            if turn_deg > most_deg:
                problems.append(f"{lane.name} turns by {turn_deg:.0f} deg where {name} continues it")
    return problems


def odd_sizes(graph: LaneGraph, width_m: tuple[float, float], speed_mps: tuple[float, float]) -> list[str]:
    """One line for each lane or walk that is too narrow or too wide, and for each lane that is too slow or too fast.

    Args:
        graph: lanes and walks of the town.
        width_m: smallest and largest width.
        speed_mps: smallest and largest speed.
    """
    problems = []
    for lane in graph.lanes.values():
        if not width_m[0] <= lane.width_m <= width_m[1]:
            problems.append(f"{lane.name} is {lane.width_m:g} m wide, not {width_m[0]:g} to {width_m[1]:g}")
        if not speed_mps[0] <= lane.speed_mps <= speed_mps[1]:
            problems.append(f"{lane.name} is for {lane.speed_mps:g} m/s, not {speed_mps[0]:g} to {speed_mps[1]:g}")
    for walk in graph.walks.values():
        if not 0.8 <= walk.width_m <= 30:
            problems.append(f"{walk.name} is {walk.width_m:g} m wide, not 0.8 to 30")
    return problems


def lost_neighbours(graph: LaneGraph) -> list[str]:
    """One line for each lane whose `left` or `right` neighbour is not on that side or has another direction.

    Args:
        graph: lanes of the town.
    """
    problems = []
    for lane in graph.lanes.values():
        middle_m, heading_rad = lane.line.at(lane.line.length_m / 2)
        for side, name, sign in (("left", lane.left, -1), ("right", lane.right, 1)):
            if not name:
                continue
            other = graph.lanes[name]
            s_m, lateral_m, distance_m = other.line.project(middle_m)
            turn_deg = math.degrees(abs(wrap_angle_rad(other.line.at(s_m)[1] - heading_rad)))
            if sign * lateral_m < 0 or not 0.5 <= distance_m / lane.width_m <= 2.5 or turn_deg > 45:
                problems.append(
                    f"{lane.name} has {name} as its {side} neighbour, which is not there at {_place(middle_m)}"
                )
    return problems


def lanes_off_the_road(town: TownUnderTest, tolerance_m: float, wheel_m: float) -> list[str]:
    """One line for each lane whose ground or visible road is at another height, or that leads over another surface.

    Args:
        town: the town under test.
        tolerance_m: largest difference between the height of a lane and its ground.
        wheel_m: distance from the middle of a lane at which the ground below the wheels is checked too.
    """
    label = {geom.id: unprefixed_class(geom.classname.name).partition(".")[0] for geom in town.compiled[0].geoms}
    problems = []
    for lane in town.graph.lanes.values():
        for point_m, place in _along(lane.line):
            if problem := _off_ground(town.ground, point_m, tolerance_m):
                problems.append(f"{lane.name} {problem} at {place}")
                break
            distance_m, geom = town.visible.first_hit(point_m - RAY_START_M * DOWN, DOWN)
            if geom < 0 or abs(distance_m - RAY_START_M) > 2 * tolerance_m:
                problems.append(f"{lane.name}: no surface is seen at its height at {place}")
                break
            if label[geom] not in DRIVABLE:
                problems.append(f"{lane.name} leads over {label[geom]} ({town.visible.name(geom)!r}) at {place}")
                break
        else:
            problems += _wheels_off(town, lane, tolerance_m, wheel_m)
    return problems


def _wheels_off(town: TownUnderTest, lane: Lane, tolerance_m: float, wheel_m: float) -> list[str]:
    step_m = KERB_M if lane.is_junction else 2 * tolerance_m
    for side, lateral_m in (("left", wheel_m), ("right", -wheel_m)):
        for point_m, place in _along(lane.line, lateral_m):
            if problem := _off_ground(town.ground, point_m, step_m):
                return [f"{lane.name} {problem} below the {side} wheels of a car at {place}"]
    return []


def walks_off_the_ground(town: TownUnderTest, tolerance_m: float) -> list[str]:
    """One line for each sidewalk or crosswalk that is more than `tolerance_m` above or below its ground.

    Args:
        town: the town under test.
        tolerance_m: largest allowed difference of heights.
    """
    problems = []
    for walk in town.graph.walks.values():
        for point_m, place in _along(walk.line):
            if problem := _off_ground(town.ground, point_m, tolerance_m):
                problems.append(f"{walk.name} {problem} at {place}")
                break
    return problems


def idle_crosswalks(graph: LaneGraph) -> list[str]:
    """One line for each crosswalk that crosses no lane, and for each end of a crosswalk far from any sidewalk.

    Args:
        graph: lanes and walks of the town.
    """
    lanes = np.concatenate([np.array([p for p, _ in _along(lane.line)]) for lane in graph.lanes.values()])[:, :2]
    pavements = [walk for walk in graph.walks.values() if not walk.is_crossing]
    problems = []
    for walk in (walk for walk in graph.walks.values() if walk.is_crossing):
        places = np.array([point for point, _ in _along(walk.line, step_m=0.5)])[:, :2]
        if np.linalg.norm(lanes[:, None] - places[None], axis=-1).min() > STEP_M:
            problems.append(f"{walk.name} crosses no lane")
        for end in (walk.line.points_m[0], walk.line.points_m[-1]):
            reach_m = min((p.line.project(end)[2] - p.width_m / 2 for p in pavements), default=math.inf)
            if reach_m > CROSSWALK_REACH_M:
                problems.append(f"{walk.name} ends at {_place(end)}, {reach_m:.1f} m from the nearest sidewalk")
    return problems


def bad_bays(town: TownUnderTest, tolerance_m: float) -> list[str]:
    """One line for each parking bay that is above or below the ground, has an obstacle inside, or lies on a lane.

    Args:
        town: the town.
        tolerance_m: largest height difference between a bay and the ground.
    """
    lanes = np.concatenate([np.array([p for p, _ in _along(lane.line)]) for lane in town.graph.lanes.values()])
    problems = []
    for bay in town.graph.bays:
        corners = _bay_corners(bay)
        off = [problem for corner in corners if (problem := _off_ground(town.ground, corner, 2 * tolerance_m))]
        if off:
            problems.append(f"{bay.name} {off[0]} in a corner")
            continue
        for start_m, end_m in ((corners[0], corners[2]), (corners[1], corners[3])):
            share, geom = town.obstacles.first_hit(start_m - BUMPER_M * DOWN, end_m - start_m)
            if share <= 1:
                problems.append(f"{bay.name} holds {town.obstacles.name(geom)!r}")
                break
        c, s = math.cos(bay.yaw_rad), math.sin(bay.yaw_rad)
        offset = lanes - bay.position_m
        along, left = offset[:, 0] * c + offset[:, 1] * s, -offset[:, 0] * s + offset[:, 1] * c
        on_it = (np.abs(along) < bay.length_m / 2) & (np.abs(left) < bay.width_m / 2) & (np.abs(offset[:, 2]) < 2)
        if on_it.any():
            problems.append(f"{bay.name} lies on a lane at {_place(lanes[np.argmax(on_it)])}")
    return problems


def out_of_bounds(graph: LaneGraph) -> list[str]:
    """One line for each lane, walk and parking bay that leaves `town.bounds`.

    Args:
        graph: lanes, walks, parking bays and bounds of the town.
    """
    xmin, ymin, xmax, ymax = graph.bounds_m
    lines = [(lane.name, lane.line.points_m) for lane in graph.lanes.values()]
    lines += [(walk.name, walk.line.points_m) for walk in graph.walks.values()]
    lines += [(bay.name, np.array([bay.position_m])) for bay in graph.bays]
    problems = []
    for name, points in lines:
        outside = (points[:, :2] < (xmin, ymin)) | (points[:, :2] > (xmax, ymax))
        if outside.any():
            problems.append(f"{name} leaves town.bounds at {_place(points[np.argmax(outside.any(axis=1))])}")
    return problems


def _off_ground(ground: Rays, point_m: Array, tolerance_m: float) -> str:
    height_m = ground.height_m(point_m, RAY_START_M)
    if math.isnan(height_m):
        return "has no collision geom named ground.… below it"
    if abs(height_m - point_m[2]) > tolerance_m:
        return f"is {point_m[2] - height_m:+.2f} m above its ground"
    return ""


def _along(line: Polyline, lateral_m: float = 0.0, step_m: float = STEP_M) -> Iterator[tuple[Array, str]]:
    """Yields points spread evenly over a line, just inside of its ends, each with its position as a text for
    messages.
    """
    count = max(2, math.ceil(line.length_m / step_m) + 1)
    for s_m in np.linspace(min(0.05, line.length_m / 4), line.length_m - min(0.05, line.length_m / 4), count):
        point = line.at(float(s_m), lateral_m)[0]
        yield point, _place(point)


def _bay_corners(bay: ParkingBay) -> Array:
    """(4, 3) points a little inside of a bay's corners, where the wheels of a parked car are."""
    along = np.array([math.cos(bay.yaw_rad), math.sin(bay.yaw_rad), 0.0]) * bay.length_m * 0.4
    left = np.array([-math.sin(bay.yaw_rad), math.cos(bay.yaw_rad), 0.0]) * bay.width_m * 0.4
    return np.asarray(np.array([along + left, along - left, -along - left, -along + left]) + bay.position_m)


def _headings(line: Polyline) -> Array:
    steps = np.diff(line.points_m[:, :2], axis=0)
    return np.asarray(np.arctan2(steps[:, 1], steps[:, 0]))


def _place(point_m: Array) -> str:
    return f"({point_m[0]:.1f}, {point_m[1]:.1f})"
