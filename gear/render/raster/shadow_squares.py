"""Where shadows of the sun are looked for: squares across its light."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.render.pinhole import NEAR_M, Frustum
from gear.values.geometry import Array

ENDS_M = (40.0, 160.0)
"""How far along the view two maps reach: one of everything, one of what moves."""

TOWARDS_SUN_M = 600.0
"""How far towards the sun a map tells depths apart; what stands farther away throws its shadow all the same."""

_ROOM = 1.005
"""How much larger than what they must show maps are: looks beside a place, and in front of it, stay on them."""

_WIDEST_M = 500.0
_OUTLIERS = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Square:
    """What a square map shows.

    Attributes:
        centre_m: (3,) of what it shows.
        axes: (3, 3) rows: two directions across the sun's light, and towards the sun.
        half_side_m: of the square.
    """

    centre_m: Array
    axes: Array
    half_side_m: float

    @property
    def scale(self) -> Array:
        """(3,) from metres along the axes to -1..1 across the map and 0..1 away from the sun."""
        return np.array([1 / self.half_side_m, 1 / self.half_side_m, -1 / (TOWARDS_SUN_M + 2 * self.half_side_m)])

    def offset(self, origin_m: Array) -> Array:
        """(3,) what to add to scaled places that are relative to an origin.

        Args:
            origin_m: (3,) in the frame of the centre.
        """
        towards_sun = -self.scale[2] * (TOWARDS_SUN_M + self.half_side_m)
        return np.asarray((0.0, 0.0, towards_sun) - self.scale * (self.axes @ (self.centre_m - origin_m)))

    def matrix(self, origin_m: Array) -> Array:
        """(4, 4) from places relative to an origin to the map.

        Args:
            origin_m: (3,) in the frame of the centre.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.scale[:, None] * self.axes, self.offset(origin_m)
        return matrix


@dataclass(frozen=True, slots=True, eq=False)
class Maps:
    """What shaders have to know of the maps: of everything near, of what moves, of the town.

    Attributes:
        axes: (3, 3) rows: of all their squares.
        scale: (3, 3) map by map, from metres along the axes to the texture, which is 1 wide and high, and to depth.
        offset: (3, 3) what to add for places relative to the camera.
        texel_m: (3,) sides of texels.
        end_m: (2,) how far along the view the first two reach.
        town_ends: where the town's map ends in the texture; what lies farther down belongs to the others.
    """

    axes: Array
    scale: Array
    offset: Array
    texel_m: Array
    end_m: Array
    town_ends: float


def squares_before(frustum: Frustum, towards_sun: Array) -> tuple[Square, ...]:
    """Squares that hold whatever the frustum shows up to each of `ENDS_M`, whichever way the sun stands.

    Args:
        frustum: who looks.
        towards_sun: (3,) unit vector in the world's axes.
    """
    axes = _axes(towards_sun)
    made = []
    begin_m = NEAR_M
    width_m = frustum.half_width_m + abs(frustum.centre_right_m)
    height_m = frustum.half_height_m + abs(frustum.centre_up_m)
    slope2 = (width_m**2 + height_m**2) / NEAR_M**2
    for end_m in ENDS_M:
        # The smallest sphere about the part of the view between its two distances.
        middle_m = min((begin_m + end_m) / 2 * (1 + slope2), end_m)
        half_side_m = _ROOM * math.sqrt((end_m - middle_m) ** 2 + slope2 * end_m**2)
        made.append(Square(frustum.position_world_m + frustum.forward_world * middle_m, axes, half_side_m))
        begin_m = end_m
    return tuple(made)


def square_about(points_m: Array, towards_sun: Array) -> Square:
    """A square over a whole town, but for what lies far outside.

    Args:
        points_m: (N, 3) some of its vertices.
        towards_sun: (3,) unit vector in the world's axes.
    """
    axes = _axes(towards_sun)
    low, high = np.quantile(points_m @ axes.T, (_OUTLIERS, 1 - _OUTLIERS), axis=0)
    half_side_m = float(np.clip(((high - low)[:2] / 2).max(), 1.0, _WIDEST_M))
    return Square((low + high) / 2 @ axes, axes, half_side_m)


def _axes(towards_sun: Array) -> Array:
    aside = np.cross((0.0, 0.0, 1.0) if abs(towards_sun[2]) < 0.99 else (0.0, 1.0, 0.0), towards_sun)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(towards_sun, aside), towards_sun])
