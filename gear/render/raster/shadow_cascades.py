"""Cascaded shadow maps of the sun: computes which part of the world each map covers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gear.render.pinhole import NEAR_M, Frustum
from gear.values.geometry import Array

CASCADE_ENDS_M = (40.0, 160.0)
"""Distances in front of the camera, metres, at which the map of all geoms and the map of moving geoms end."""

TOWARDS_SUN_RANGE_M = 600.0
"""Range of depth of a shadow map towards the sun, metres. Geoms beyond this range are clamped to its end and still cast
shadows.
"""

_MARGIN = 1.005
"""Factor by which shadow maps are larger than the part of the world that they must cover. Filtered reads at the edge
therefore stay inside the map.
"""

_WIDEST_M = 500.0
_OUTLIERS = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Cascade:
    """The square, perpendicular to the sun's rays, that one shadow map covers.

    Attributes:
        centre_m: (3,) middle of the square, world coordinates.
        axes: (3, 3) rows: two unit vectors across the sun's rays, and one towards the sun.
        half_side_m: half the length of its sides.
        receivers_m: (N, 3) corners of the convex part of the world in which shadows of the map are visible; None for
            everywhere.
    """

    centre_m: Array
    axes: Array
    half_side_m: float
    receivers_m: Array | None = None

    @property
    def scale(self) -> Array:
        """The (3,) factors that convert metres along `axes` to map coordinates: -1..1 across the map, and 0..1 away
        from the sun.
        """
        return np.array([1 / self.half_side_m, 1 / self.half_side_m, -1 / (TOWARDS_SUN_RANGE_M + 2 * self.half_side_m)])

    def offset(self, origin_m: Array) -> Array:
        """The (3,) offset of map coordinates for positions relative to an origin: map coordinates are scaled positions
        plus this offset.

        Args:
            origin_m: (3,) origin, in world coordinates.
        """
        towards_sun = -self.scale[2] * (TOWARDS_SUN_RANGE_M + self.half_side_m)
        return np.asarray((0.0, 0.0, towards_sun) - self.scale * (self.axes @ (self.centre_m - origin_m)))

    def seen_part(self, margin_m: float) -> tuple[Array, Array]:
        """The part of the map in which shadows are visible: (2,) smallest and (2,) largest map coordinates, -1..1.

        Args:
            margin_m: distance by which the visible part of the world is enlarged.
        """
        if self.receivers_m is None:
            return np.full(2, -1.0), np.full(2, 1.0)
        across = ((self.receivers_m - self.centre_m) @ self.axes.T)[:, :2]
        ends = (across.min(axis=0) - margin_m) / self.half_side_m, (across.max(axis=0) + margin_m) / self.half_side_m
        low, high = (np.clip(end, -1.0, 1.0) for end in ends)
        return low, high

    def matrix(self, origin_m: Array) -> Array:
        """The (4, 4) matrix that converts positions relative to an origin to map coordinates.

        Args:
            origin_m: (3,) origin, in world coordinates.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.scale[:, None] * self.axes, self.offset(origin_m)
        return matrix


@dataclass(frozen=True, slots=True, eq=False)
class ShadowMaps:
    """The three shadow maps in the form that shaders read: of all near geoms, of moving geoms, and of the whole town.

    Attributes:
        axes: (3, 3) rows: the axes that all three maps share.
        scale: (3, 3), one row per map: factors from metres along the axes to texture coordinates 0..1 and depth 0..1.
        offset: (3, 3), one row per map: offset for positions relative to the camera.
        texel_m: (3,) side of a texel in metres.
        end_m: (2,) distances in front of the camera, metres, at which the first two maps end.
        town_ends: texture coordinate 0..1 of the row at which the map of the whole town ends; the two smaller maps lie
            below this row.
    """

    axes: Array
    scale: Array
    offset: Array
    texel_m: Array
    end_m: Array
    town_ends: float


def view_cascades(frustum: Frustum, towards_sun: Array) -> tuple[Cascade, ...]:
    """The squares of two shadow maps. The first covers the view up to the first distance in `CASCADE_ENDS_M`, the
    second the view between the two distances.

    Args:
        frustum: the camera's view volume.
        towards_sun: (3,) unit vector, world axes.
    """
    axes = _axes(towards_sun)
    made = []
    begin_m = NEAR_M
    width_m = frustum.half_width_m + abs(frustum.centre_right_m)
    height_m = frustum.half_height_m + abs(frustum.centre_up_m)
    slope2 = (width_m**2 + height_m**2) / NEAR_M**2
    for end_m in CASCADE_ENDS_M:
        # The smallest sphere around the part of the view between the two distances.
        middle_m = min((begin_m + end_m) / 2 * (1 + slope2), end_m)
        half_side_m = _MARGIN * math.sqrt((end_m - middle_m) ** 2 + slope2 * end_m**2)
        centre_m = frustum.position_world_m + frustum.forward_world * middle_m
        made.append(Cascade(centre_m, axes, half_side_m, frustum.slice_corners(begin_m, end_m)))
        begin_m = end_m
    return tuple(made)


def town_cascade(points_m: Array, towards_sun: Array) -> Cascade:
    """The square of the shadow map that covers the whole town; vertices far outside the town are ignored.

    Args:
        points_m: (N, 3) some vertices of the town, world coordinates.
        towards_sun: (3,) unit vector, world axes.
    """
    axes = _axes(towards_sun)
    low, high = np.quantile(points_m @ axes.T, (_OUTLIERS, 1 - _OUTLIERS), axis=0)
    half_side_m = float(np.clip(((high - low)[:2] / 2).max(), 1.0, _WIDEST_M))
    return Cascade((low + high) / 2 @ axes, axes, half_side_m)


def _axes(towards_sun: Array) -> Array:
    aside = np.cross((0.0, 0.0, 1.0) if abs(towards_sun[2]) < 0.99 else (0.0, 1.0, 0.0), towards_sun)
    aside /= np.linalg.norm(aside)
    return np.stack([aside, np.cross(towards_sun, aside), towards_sun])
