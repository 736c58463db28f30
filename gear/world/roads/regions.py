"""Regions of the ground that represent the limits of a scene, and the pieces of lanes and walks inside such a
region.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array
from gear.world.roads.polyline import Polyline
from gear.world.scene_spec import BoardSpec, Range

TABLE_STEP_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A region of the ground: relative to a board, relative to the ego car, or the intersection of two such regions.

    Attributes:
        board: the board in whose frame `ahead_m` and `lateral_m` are given; None for no such limits.
        ahead_m: smallest and largest distance in front of the board's face; None for no limit.
        lateral_m: smallest and largest distance to the left of the direction in which the board faces; None for no
            limit.
        radius_m: smallest and largest distance from `centre_m`; None for no limit.
        centre_m: x and y of the ego car, world coordinates.
    """

    board: BoardSpec | None = None
    ahead_m: Range | None = None
    lateral_m: Range | None = None
    radius_m: Range | None = None
    centre_m: tuple[float, float] = (0.0, 0.0)

    def holds(self, xy_m: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Tests which of (N, 2) points in world coordinates lie inside the region: (N,) bool.

        Args:
            xy_m: (N, 2) x and y of the points, metres.
        """
        places = np.atleast_2d(np.asarray(xy_m, dtype=np.float64))
        inside = np.ones(len(places), bool)
        if self.board is not None:
            offset = places - np.array(self.board.position_m[:2])
            c, s = math.cos(math.radians(self.board.facing_deg)), math.sin(math.radians(self.board.facing_deg))
            ahead, left = offset @ np.array([c, s]), offset @ np.array([-s, c])
            for values, limits in ((ahead, self.ahead_m), (left, self.lateral_m)):
                if limits is not None:
                    inside &= (values >= limits[0]) & (values <= limits[1])
        if self.radius_m is not None:
            distance = np.linalg.norm(places - np.array(self.centre_m), axis=1)
            inside &= (distance >= self.radius_m[0]) & (distance <= self.radius_m[1])
        return inside


@dataclass(frozen=True, slots=True, eq=False)
class LineTable:
    """Lanes or walks that are cut into N pieces of about a metre; positions are drawn at random from the pieces.

    Attributes:
        names: (N,) name of the line to which each piece belongs.
        s_m: (N,) arc length of the middle of each piece.
        length_m: (N,) length of each piece.
        points_m: (N, 3) middle of each piece, world coordinates.
        weight: (N,) relative probability per metre of each piece.
    """

    names: tuple[str, ...]
    s_m: Array
    length_m: Array
    points_m: Array
    weight: Array

    @staticmethod
    def of(lines: Iterable[tuple[str, Polyline, float]]) -> LineTable:
        """Cuts lines into pieces of about a metre.

        Args:
            lines: tuples (name, line, weight) of the lanes or walks; the weight is the relative probability per metre.
        """
        names: list[str] = []
        parts = [np.zeros((0, 6))]
        for name, line, weight in lines:
            pieces = max(1, round(line.length_m / TABLE_STEP_M))
            step_m = line.length_m / pieces
            s_m = (np.arange(pieces, dtype=np.float64) + 0.5) * step_m
            names += [name] * pieces
            ones = np.ones(pieces)
            parts.append(np.column_stack([s_m, step_m * ones, line.points_at(s_m), weight * ones]))
        table = np.concatenate(parts)
        return LineTable(tuple(names), table[:, 0], table[:, 1], table[:, 2:5], table[:, 5])

    def inside(self, region: Region) -> npt.NDArray[np.intp]:
        """The (M,) indices of the pieces whose middle lies inside a region.

        Args:
            region: the region of the ground.
        """
        return np.flatnonzero(region.holds(self.points_m[:, :2])) if self.names else np.zeros(0, np.intp)

    def draw(self, pieces: npt.NDArray[np.intp], rng: np.random.Generator) -> tuple[str, float]:
        """Draws a random position on the given pieces. The probability of a piece is proportional to its weight times
        its length.

        Args:
            pieces: (M,) indices of pieces; at least one.
            rng: random generator.

        Returns:
            Name of the line, and arc length on this line.
        """
        shares = np.cumsum(self.weight[pieces] * self.length_m[pieces])
        piece = int(pieces[min(int(np.searchsorted(shares, rng.random() * shares[-1])), len(pieces) - 1)])
        return self.names[piece], float(self.s_m[piece] + (rng.random() - 0.5) * self.length_m[piece])
