"""Polylines in the plane: the centre lines of which streets, kerbs and lanes are made.

Angles go through the C library: NumPy's own functions differ in the last digit between processors with and without
AVX-512, which decides on which side of a bend a mark falls that lies at it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
ARC_STEP_M = 2.0
ARC_STEP_RAD = np.radians(9.0)


def filleted(corners: Sequence[tuple[float, float]], radii_m: Sequence[float]) -> Array:
    """A polyline (N, 2) through `corners` with every inner corner rounded.

    Args:
        corners: at least two points.
        radii_m: one radius an inner corner.
    """
    points = np.asarray(corners, np.float64)
    line = [points[0]]
    for before, corner, after, radius in zip(points[:-2], points[1:-1], points[2:], radii_m, strict=True):
        line.extend(_arc(before, corner, after, radius))
    line.append(points[-1])
    return np.asarray(line)


def _arc(before: Array, corner: Array, after: Array, radius_m: float) -> Array:
    incoming = (corner - before) / np.linalg.norm(corner - before)
    outgoing = (after - corner) / np.linalg.norm(after - corner)
    turn = math.atan2(_cross(incoming, outgoing), incoming @ outgoing)
    tangent = radius_m * math.tan(abs(turn) / 2)
    room = min(np.linalg.norm(corner - before), np.linalg.norm(after - corner))
    if tangent > room:
        raise ValueError(f"a fillet of {radius_m} m at {corner.tolist()} needs {tangent:.1f} m of {room:.1f} m")
    steps = max(2, int(np.ceil(abs(turn) * max(radius_m / ARC_STEP_M, 1 / ARC_STEP_RAD))))
    side = np.sign(turn)
    start = corner - incoming * tangent
    centre = start + side * radius_m * np.array([-incoming[1], incoming[0]])
    angles = np.linspace(0, turn, steps + 1)
    spoke = start - centre
    cos, sin = (np.array([f(angle) for angle in angles]) for f in (math.cos, math.sin))
    arc: Array = centre + np.stack([spoke[0] * cos - spoke[1] * sin, spoke[0] * sin + spoke[1] * cos], 1)
    return arc


def stations(line: Array) -> Array:
    """The distance (N,) along a line at each of its points, in metres."""
    steps = np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def length(line: Array) -> float:
    """The length of a line in metres."""
    return float(stations(line)[-1])


def at(line: Array, station_m: float) -> tuple[Array, Array]:
    """The point (2,) and unit direction (2,) at a distance along a line."""
    along = stations(line)
    index = int(np.clip(np.searchsorted(along, station_m, side="right") - 1, 0, len(line) - 2))
    direction = line[index + 1] - line[index]
    direction = direction / np.linalg.norm(direction)
    return line[index] + direction * (station_m - along[index]), direction


def cut(line: Array, start_m: float, end_m: float) -> Array:
    """The stretch of a line between two distances along it."""
    along = stations(line)
    inner = line[(along > start_m + 1e-3) & (along < end_m - 1e-3)]
    return np.concatenate([[at(line, start_m)[0]], inner, [at(line, end_m)[0]]])


def offset(line: Array, left_m: float) -> Array:
    """A line at a constant distance to the left (to the right if negative), with as many points."""
    steps = np.diff(line, axis=0)
    directions = steps / np.linalg.norm(steps, axis=1, keepdims=True)
    normals = np.stack([-directions[:, 1], directions[:, 0]], 1)
    before = np.concatenate([normals[:1], normals])
    after = np.concatenate([normals, normals[-1:]])
    mitre = before + after
    mitre /= (mitre * after).sum(1, keepdims=True)
    moved: Array = line + left_m * mitre
    return moved


def densified(line: Array, step_m: float) -> Array:
    """A line with points no farther apart than `step_m`."""
    pieces = [line[:1]]
    for start, end in pairwise(line):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step_m - 1e-6)))
        pieces.append(start + np.linspace(0, 1, count + 1)[1:, None] * (end - start))
    return np.concatenate(pieces)


def blend(start: Array, heading: Array, end: Array, end_heading: Array) -> Array:
    """A smooth curve (N, 2) that leaves `start` along `heading` and reaches `end` along `end_heading`."""
    turn = math.atan2(_cross(heading, end_heading), heading @ end_heading)
    chord = float(np.linalg.norm(end - start))
    reach = chord / 3
    if abs(turn) > np.radians(12):
        # Bezier arms for which a symmetric turn is a circle to within a thousandth.
        first = _cross(end - start, end_heading) / _cross(heading, end_heading)
        second = _cross(end - start, heading) / _cross(heading, end_heading)
        if first > 0 and second > 0:
            arm = 4 / 3 * math.tan(abs(turn) / 4) / math.tan(abs(turn) / 2)
            return _bezier(start, start + heading * first * arm, end - end_heading * second * arm, end, turn)
        reach = chord / 2
    return _bezier(start, start + heading * reach, end - end_heading * reach, end, turn)


def _bezier(a: Array, b: Array, c: Array, d: Array, turn: float) -> Array:
    span = np.linalg.norm(b - a) + np.linalg.norm(c - b) + np.linalg.norm(d - c)
    count = int(max(np.ceil(span / 1.5), np.ceil(abs(turn) / np.radians(7)), 3))
    t = np.linspace(0, 1, count + 1)[:, None]
    return (1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
