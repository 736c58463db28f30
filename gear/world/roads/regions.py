"""Where the limits of a scene lie on the ground plan, and the places on lanes and walks inside them."""

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
    """Limits around a board, around the ego car, or both.

    Attributes:
        board: whose frame `ahead_m` and `lateral_m` are in; None where there is none.
        ahead_m, lateral_m: from, to; None for no limit.
        radius_m: from, to, around `centre_m`; None for no limit.
        centre_m: the ego car's place.
    """

    board: BoardSpec | None = None
    ahead_m: Range | None = None
    lateral_m: Range | None = None
    radius_m: Range | None = None
    centre_m: tuple[float, float] = (0.0, 0.0)

    def holds(self, xy_m: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """(N, 2) places to (N,) whether each is inside."""
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
    """Many lines, cut into pieces of about a metre; drawing a piece evenly draws a place evenly.

    Attributes:
        names: (N,) which line each piece is of.
        s_m: (N,) arc length of its middle.
        length_m: (N,) of the piece.
        points_m: (N, 3) its middle.
        weight: (N,) how much more often than others a metre of it is drawn.
    """

    names: tuple[str, ...]
    s_m: Array
    length_m: Array
    points_m: Array
    weight: Array

    @staticmethod
    def of(lines: Iterable[tuple[str, Polyline, float]]) -> LineTable:
        """From (name, line, weight)."""
        names: list[str] = []
        rows: list[tuple[float, float, float, float, float, float]] = []
        for name, line, weight in lines:
            pieces = max(1, round(line.length_m / TABLE_STEP_M))
            step_m = line.length_m / pieces
            for piece in range(pieces):
                s_m = (piece + 0.5) * step_m
                x, y, z = line.at(s_m)[0]
                names.append(name)
                rows.append((s_m, step_m, float(x), float(y), float(z), weight))
        table = np.array(rows, dtype=np.float64).reshape(-1, 6)
        return LineTable(tuple(names), table[:, 0], table[:, 1], table[:, 2:5], table[:, 5])

    def inside(self, region: Region) -> npt.NDArray[np.intp]:
        """Indices of the pieces whose middle lies inside a region."""
        return np.flatnonzero(region.holds(self.points_m[:, :2])) if self.names else np.zeros(0, np.intp)

    def draw(self, pieces: npt.NDArray[np.intp], rng: np.random.Generator) -> tuple[str, float]:
        """A line and an arc length, evenly over the pieces given; they must not be empty."""
        shares = np.cumsum(self.weight[pieces] * self.length_m[pieces])
        piece = int(pieces[min(int(np.searchsorted(shares, rng.random() * shares[-1])), len(pieces) - 1)])
        return self.names[piece], float(self.s_m[piece] + (rng.random() - 0.5) * self.length_m[piece])
