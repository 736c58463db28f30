"""Polylines in world coordinates, with positions on them by arc length."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.values.geometry import Array, frozen


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """A polyline with its arc length, which is measured horizontally (climbs do not count).

    Attributes:
        points_m: (N, 3) points in world coordinates; neighbouring points differ.
        s_m: (N,) arc length at each point, from 0.
    """

    points_m: Array
    s_m: Array

    @staticmethod
    def through(points_m: Array) -> Polyline:
        """Makes the polyline through points, and computes its arc lengths.

        Args:
            points_m: (N, 3) points in world coordinates, metres, at least two.
        """
        steps_m = np.linalg.norm(np.diff(points_m[:, :2], axis=0), axis=1)
        return Polyline(frozen(points_m), frozen(np.concatenate([[0.0], np.cumsum(steps_m)])))

    @property
    def length_m(self) -> float:
        """Arc length of the whole line."""
        return float(self.s_m[-1])

    def segment(self, s_m: float) -> int:
        """Index of the segment at an arc length; beyond the ends, the index of the first or last segment.

        Args:
            s_m: arc length in metres.

        Returns:
            The index i of the segment between `points_m[i]` and `points_m[i + 1]`.
        """
        return min(max(int(self.s_m.searchsorted(s_m, side="right")) - 1, 0), len(self.s_m) - 2)

    def at(self, s_m: float, lateral_m: float = 0.0) -> tuple[Array, float]:
        """The point beside the line at an arc length, and the heading of the line there.

        Args:
            s_m: arc length; beyond its ends the line continues straight.
            lateral_m: distance of the point to the left of the line.

        Returns:
            (3,) point in metres, and heading in radians counter-clockwise from east.
        """
        index = self.segment(s_m)
        step = self.points_m[index + 1] - self.points_m[index]
        length_m = math.hypot(step[0], step[1])
        point = self.points_m[index] + step * ((s_m - self.s_m[index]) / length_m)
        point[:2] += np.array([-step[1], step[0]]) * (lateral_m / length_m)
        return point, math.atan2(step[1], step[0])

    def points_at(self, s_m: Array) -> Array:
        """The points on the line at several arc lengths: (N, 3), bit for bit those of `at`.

        Args:
            s_m: (N,) arc lengths in metres; beyond its ends the line continues straight.
        """
        index = np.clip(np.searchsorted(self.s_m, s_m, side="right") - 1, 0, len(self.s_m) - 2)
        steps = np.diff(self.points_m, axis=0)
        # NumPy's own hypot may differ from Python's in the last bit.
        lengths_m = np.array([math.hypot(x, y) for x, y in steps[:, :2].tolist()])
        return np.asarray(self.points_m[index] + steps[index] * ((s_m - self.s_m[index]) / lengths_m[index])[:, None])

    def heading(self, s_m: float, reach_m: float) -> float:
        """The mean heading of the line around an arc length, which changes steadily around a corner, unlike the
        heading of a segment.

        Args:
            s_m: arc length in metres.
            reach_m: the mean is taken from `reach_m` metres before this arc length to `reach_m` metres after it.

        Returns:
            Radians, counter-clockwise from east.
        """
        steps = np.diff(self.points_m[:, :2], axis=0)
        headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        ends_m = np.concatenate([[-np.inf], self.s_m[1:-1], [np.inf]])
        within_m = np.minimum(ends_m[1:], s_m + reach_m) - np.maximum(ends_m[:-1], s_m - reach_m)
        return float(headings @ np.clip(within_m, 0.0, None) / (2 * reach_m))

    def sample(self, s_m: Array, lateral_m: float = 0.0) -> tuple[Array, Array]:
        """The points beside the line at several arc lengths (N,), and the headings there: (N, 3) points in metres and
        (N,) headings in radians.

        Args:
            s_m: (N,) arc lengths in metres.
            lateral_m: distance to the left of the line in metres.
        """
        index = np.clip(np.searchsorted(self.s_m, s_m, side="right") - 1, 0, len(self.s_m) - 2)
        steps = self.points_m[index + 1] - self.points_m[index]
        lengths_m = np.hypot(steps[:, 0], steps[:, 1])
        points = self.points_m[index] + steps * ((s_m - self.s_m[index]) / lengths_m)[:, None]
        points[:, :2] += np.stack([-steps[:, 1], steps[:, 0]], axis=1) * (lateral_m / lengths_m)[:, None]
        return points, np.arctan2(steps[:, 1], steps[:, 0])

    def project(self, position_m: Array) -> tuple[float, float, float]:
        """Finds the position on the line that is nearest to a point (3,) in world coordinates.

        Args:
            position_m: (3,) point.

        Returns:
            Arc length, distance of the point to the left of the line, and 3D distance; all in metres.
        """
        starts, steps = self.points_m[:-1], np.diff(self.points_m, axis=0)
        squared = np.einsum("ij,ij->i", steps[:, :2], steps[:, :2])
        shares = np.clip(np.einsum("ij,ij->i", position_m[:2] - starts[:, :2], steps[:, :2]) / squared, 0.0, 1.0)
        nearest = starts + shares[:, None] * steps
        distances_m = np.linalg.norm(position_m - nearest, axis=1)
        index = int(np.argmin(distances_m))
        length_m = math.sqrt(squared[index])
        offset = position_m[:2] - starts[index, :2]
        lateral_m = (steps[index, 0] * offset[1] - steps[index, 1] * offset[0]) / length_m
        return float(self.s_m[index] + shares[index] * length_m), float(lateral_m), float(distances_m[index])
