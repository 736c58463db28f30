"""Finds obstacles on the lanes and walks of a town; each function returns one line for each blocked lane or walk.

Obstacles are collision geoms and visible geoms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from gear.testing.town_facts import DOWN, RAY_START_M, Rays, TownUnderTest
from gear.values.geometry import Array
from gear.world.roads.polyline import Polyline

CAR_HEIGHTS_M = (0.3, 0.7, 1.3, 1.9)
"""Heights of the rays above the road: over a kerb, at a bumper, at a windscreen, at the windscreen of a van."""

CAR_SIDE_M = 1.3
"""Half the width of a bus. In narrower lanes the rays end `LANE_EDGE_M` before the edge of the lane."""

LANE_EDGE_M = 0.2
COLLISION_GAP_M, VISIBLE_GAP_M = 0.2, 0.4
"""Distances between neighbouring rays across a lane, for collision geoms and for visible geoms (slower rays)."""

PERSON_HEIGHTS_M = (0.4, 0.8, 1.3, 1.7)
PERSON_RAYS = 3
"""Number of neighbouring rays that must hit nothing for a person to pass: half a metre."""

PERSON_GAP_M = 0.25
WALK_PIECE_M = 0.5

DETOUR_M, STEP_UP_M = 1.0, 0.1
"""Distance beyond the edge of a walk to which people go around an obstacle, on ground that differs by at most
`STEP_UP_M`."""


def blocked_lanes(town: TownUnderTest) -> list[str]:
    """One line for each lane with an obstacle within the width and height of the vehicles that use the lane.

    Args:
        town: the town under test.
    """
    problems = []
    for lane in town.graph.lanes.values():
        side_m = max(0.0, min(CAR_SIDE_M, lane.width_m / 2 - LANE_EDGE_M))
        for rays, gap_m in ((town.obstacles, COLLISION_GAP_M), (town.visible, VISIBLE_GAP_M)):
            across_m = np.linspace(-side_m, side_m, math.ceil(2 * side_m / gap_m) + 1)
            hits = _hits(rays, lane.line, across_m, CAR_HEIGHTS_M)
            if hit := next(hits, None):
                problems.append(f"{lane.name} is blocked by {rays.name(hit[1])!r} at {_place(hit[0])}")
                break
    return problems


def blocked_walks(town: TownUnderTest) -> list[str]:
    """One line for each walk with an obstacle that a person can neither pass nor go around.

    Args:
        town: the town under test.
    """
    problems = []
    for walk in town.graph.walks.values():
        for start_m, end_m in pairwise(walk.line.points_m):
            if found := _stopped(town, start_m, end_m, walk.width_m / 2):
                problems.append(f"{walk.name} is blocked by {found}")
                break
    return problems


def _stopped(town: TownUnderTest, start_m: Array, end_m: Array, edge_m: float) -> str:
    """Name and position of the obstacle that blocks a straight piece of a walk; empty if people can pass."""
    side_m = max(PERSON_GAP_M, edge_m - PERSON_GAP_M)
    is_short = float(np.linalg.norm(end_m - start_m)) <= WALK_PIECE_M
    if is_short:
        side_m += DETOUR_M
    across_m = np.linspace(-side_m, side_m, math.ceil(2 * side_m / PERSON_GAP_M) + 1)
    free, named = np.ones(len(across_m), bool), ""
    for column, lateral_m in enumerate(across_m.tolist()):
        for rays in (town.obstacles, town.visible):
            hit = _first(rays, start_m, end_m, lateral_m, PERSON_HEIGHTS_M)
            if hit is not None:
                free[column] = False
                named = f"{rays.name(hit[1])!r} at {_place(hit[0])}" if abs(lateral_m) <= edge_m else named
                break
        if is_short and free[column] and abs(lateral_m) > edge_m:
            middle_m = (start_m + end_m) / 2 + lateral_m * _left(end_m - start_m)
            height_m = town.ground.height_m(middle_m, RAY_START_M)
            free[column] = abs(height_m - middle_m[2]) <= STEP_UP_M
    if np.convolve(free, np.ones(PERSON_RAYS), "valid").max() == PERSON_RAYS:
        return ""
    if is_short:
        return named
    # No straight path leads along the whole piece, but a winding path may.
    middle_m = (start_m + end_m) / 2
    return _stopped(town, start_m, middle_m, edge_m) or _stopped(town, middle_m, end_m, edge_m)


def _hits(rays: Rays, line: Polyline, across_m: Array, heights_m: tuple[float, ...]) -> Iterator[tuple[Array, int]]:
    """Yields the points along a line at which rays hit a geom, and the geom's id."""
    for start_m, end_m in pairwise(line.points_m):
        for lateral_m in across_m:
            hit = _first(rays, start_m, end_m, float(lateral_m), heights_m)
            if hit is not None:
                yield hit


def _first(
    rays: Rays, start_m: Array, end_m: Array, lateral_m: float, heights_m: tuple[float, ...]
) -> tuple[Array, int] | None:
    """First hit of the rays along a straight piece, at a distance to its left and at several heights, or None."""
    along = end_m - start_m
    left = _left(along)
    for height_m in heights_m:
        origin_m = start_m + lateral_m * left - height_m * DOWN
        share, geom = rays.first_hit(origin_m, along)
        if share <= 1:
            return origin_m + share * along, geom
    return None


def _left(along: Array) -> Array:
    return np.array([-along[1], along[0], 0.0]) / math.hypot(along[0], along[1])


def _place(point_m: Array) -> str:
    return f"({point_m[0]:.1f}, {point_m[1]:.1f})"
