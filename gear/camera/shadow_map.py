"""Shadow maps of lamps: for each direction from a lamp, the distance at which its light is stopped.

Directions are mapped to cells by a paraboloid about the lamp's axis (Heidrich and Seidel, 1998). Shadows are filtered
over nine cells (percentage-closer filtering; Reeves, Salesin and Cook, 1987), which gives edges that are soft over
about two cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.surface_points import longest_edges
from gear.values.frames import FloatImage
from gear.values.geometry import Array

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.int64]

OWN_GLASS_M = 0.8
"""Surfaces nearer to a lamp than this belong to the lamp and cast no shadows, metres."""

BORDER = 2
"""Width in cells of the border of a shadow map; no object stops light in the border."""

_LEVEL, _EDGE_ON = 0.9, 1e-6
_SLACK_M, _MOST_TILT, _STEEP = 0.15, 6.0, 2.5
_SOLE_M, _CLOSED_CELLS = 0.1, 9
_LARGEST, _FRACTION_BITS = 0.3, 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Size and field of view of a shadow map.

    Attributes:
        cells: number of cells along each side.
        zoom: 1 for the half space in front of the lamp; larger values give a narrower field of view with finer cells.
    """

    cells: int
    zoom: float

    @property
    def grain_rad(self) -> float:
        """Smallest angle between neighbouring cells, radians."""
        return 2 / (self.cells * self.zoom)

    @property
    def half_angle_rad(self) -> float:
        """Angle between the lamp's axis and the corners of the map, radians."""
        return 2 * math.atan(math.sqrt(2) / self.zoom)

    def empty(self) -> Floats:
        """A (cells, cells) float32 shadow map in which no object stops light: all distances are infinite."""
        return np.full((self.cells, self.cells), np.inf, np.float32)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampFrame:
    """Position and axes of a lamp, and the projection of directions onto the cells of its shadow map.

    Attributes:
        place_m: (3,) float32 world position.
        frame: (3, 3) float32; the rows are unit vectors across, up and along the lamp's axis.
        layout: size and field of view of the shadow map.
    """

    place_m: Floats
    frame: Floats
    layout: Layout

    @staticmethod
    def of(place_m: Array, axis: Array, layout: Layout) -> LampFrame:
        """Computes the axes of a lamp.

        Args:
            place_m: (3,) world position of the lamp in metres.
            axis: (3,) world direction in which the lamp shines, of any length above 0.
            layout: size and field of view of the lamp's shadow map.
        """
        along = axis / np.linalg.norm(axis)
        across = np.cross(along, (0.0, 0.0, 1.0) if abs(along[2]) < _LEVEL else (0.0, 1.0, 0.0))
        across /= np.linalg.norm(across)
        frame = np.stack([across, np.cross(across, along), along])
        return LampFrame(place_m=place_m.astype(np.float32), frame=frame.astype(np.float32), layout=layout)

    def places(self, unit: Floats) -> tuple[Floats, Floats]:
        """Returns the columns and rows in the shadow map of some directions, (N,) each; whole numbers are centres
        of cells.

        Directions behind the lamp get positions outside the map.

        Args:
            unit: (3, N) unit vectors from the lamp, world axes.
        """
        across, up, along = self.frame @ unit
        scale = np.float32(self.layout.zoom * self.layout.cells / 2) / np.maximum(1 + along, np.float32(1e-3))
        middle = np.float32(self.layout.cells / 2 - 0.5)
        return across * scale + middle, up * scale + middle

    def directions(self, column: Indices, row: Indices) -> Floats:
        """Returns the (N, 3) world unit vectors from the lamp through the centres of cells; the inverse of
        `places`.

        Args:
            column, row: (N,) positions of the cells in the shadow map.
        """
        across, up = ((2 * (cell + 0.5) / self.layout.cells - 1) / self.layout.zoom for cell in (column, row))
        square = across * across + up * up
        unit = np.stack([2 * across, 2 * up, 1 - square], axis=1) / (1 + square)[:, None]
        return unit.astype(np.float32) @ self.frame


def lengths(vectors: Floats) -> Floats:
    """Returns the (N,) lengths of N vectors.

    Args:
        vectors: (3, N): the vectors are the columns.
    """
    x, y, z = vectors
    return np.asarray(np.sqrt(x * x + y * y + z * z))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ShadowMap:
    """The shadow map (Williams 1978) of one lamp.

    Attributes:
        lamp_frame: position and axes of the lamp.
        stop_m: (cells, cells) float32 distance in metres at which light is stopped, by direction; infinite where no
            object stops light, and in the border. It must not be changed after construction.
    """

    lamp_frame: LampFrame
    stop_m: Floats
    _least_m: Floats = field(init=False, repr=False)
    _most_m: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        nine = np.ones((3, 3), np.uint8)
        object.__setattr__(self, "_least_m", cv2.erode(self.stop_m, nine))
        object.__setattr__(self, "_most_m", cv2.dilate(self.stop_m, nine))

    def through(self, unit: Floats, distance_m: FloatImage, facing: FloatImage, up: FloatImage) -> Floats:
        """The share of the lamp's light that reaches each of N surfaces: (N,) values in 0..1.

        Args:
            unit: (3, N) unit vectors from the lamp to the surfaces.
            distance_m: (N,) distances of the surfaces from the lamp, metres.
            facing: (N,) cosines between the surfaces' normals and the direction to the lamp.
            up: (N,) upward components of the normals; level ground does not shadow itself.
        """
        layout = self.lamp_frame.layout
        # Directions outside of the map are clamped to its border, where nothing stops light.
        across, along = (np.clip(place, 1, layout.cells - 1.001) for place in self.lamp_frame.places(unit))
        column, row = across.astype(np.int32), along.astype(np.int32)
        cosine = np.clip(facing, np.float32(1e-3), 1)
        tilt = np.minimum(np.sqrt(1 - cosine * cosine) / cosine, np.float32(_MOST_TILT))
        tilt[up > _LEVEL] = 0
        reach_m = distance_m * (1 - np.float32(_STEEP * layout.grain_rad) * tilt) - np.float32(_SLACK_M)
        middle = row * layout.cells + column
        is_free = (self._least_m.reshape(-1)[middle] >= reach_m) | (self.lamp_frame.frame[2] @ unit <= 0)
        through: Floats = is_free.astype(np.float32)
        edge = np.flatnonzero(~is_free & (self._most_m.reshape(-1)[middle] >= reach_m))
        through[edge] = self._at_edges(middle[edge], (across - column)[edge], (along - row)[edge], reach_m[edge])
        return through

    def _at_edges(self, middle: npt.NDArray[np.int32], x: Floats, y: Floats, reach_m: Floats) -> Floats:
        """Shares of light for directions in whose nine surrounding cells at least one stops the light."""
        cells, stop_m = self.lamp_frame.layout.cells, self.stop_m.reshape(-1)
        through = np.zeros_like(reach_m)
        for down, high in zip((-cells, 0, cells), _weights(y), strict=True):
            for aside, wide in zip((-1, 0, 1), _weights(x), strict=True):
                through += high * wide * (stop_m[middle + (down + aside)] >= reach_m)
        return through


def _weights(share: Floats) -> tuple[Floats, Floats, Floats]:
    """Weights of three cells for a box filter two cells wide, whose middle lies `share` (0..1) beyond the middle
    of the second cell.
    """
    half = np.full_like(share, 0.5)
    return half - half * share, half, half * share


def first_hits(corners_m: Floats, lamp_frame: LampFrame) -> Floats:
    """Computes the shadow map of triangles: (cells, cells) float32 distances in metres at which they stop a lamp's
    light, infinite where they do not.

    Back faces of triangles are skipped, because the front of the same body is nearer.

    Args:
        corners_m: (N, 3, 3) corners of the triangles in world coordinates.
        lamp_frame: position and axes of the lamp.
    """
    layout = lamp_frame.layout
    corners = _split(corners_m - lamp_frame.place_m, lamp_frame.frame[2])
    flat = np.ascontiguousarray(corners.reshape(-1, 3).T)
    corner_m = lengths(flat)
    unit = np.asarray(flat / np.maximum(corner_m, _EDGE_ON), np.float32)
    places = np.stack(lamp_frame.places(unit), axis=1).reshape(-1, 3, 2)
    corner_m = corner_m.reshape(-1, 3)
    distance_m = corner_m.mean(axis=1)
    shown = np.flatnonzero((np.abs(places) < 2 * layout.cells).all(axis=(1, 2)) & (distance_m > OWN_GLASS_M))
    # Painter's algorithm: nearer triangles are drawn last.
    shown = shown[np.argsort(-distance_m[shown], kind="stable")]
    outlines = np.rint(places[shown] * (1 << _FRACTION_BITS)).astype(np.int32)
    painted = np.full((layout.cells, layout.cells), -1, np.int32)
    for number, outline in enumerate(outlines):
        cv2.fillConvexPoly(painted, outline, number, cv2.LINE_8, _FRACTION_BITS)
    row, column = (index + BORDER for index in np.nonzero(painted[BORDER:-BORDER, BORDER:-BORDER] >= 0))
    met = shown[painted[row, column]]
    first = corners[met, 0]
    normal = _normals(corners[met])
    slope = np.einsum("nd,nd->n", normal, lamp_frame.directions(column, row))
    plane_m = np.einsum("nd,nd->n", normal, first) / np.minimum(slope, np.float32(-_EDGE_ON))
    stop_m = layout.empty()
    stop_m[row, column] = np.clip(plane_m, corner_m[met].min(axis=1), corner_m[met].max(axis=1))
    return stop_m


def _split(corners: Floats, axis: Floats) -> Floats:
    """Front faces of triangles in front of a lamp, cut into parts until the map's curved projection of each is
    nearly straight.
    """
    left = corners[np.einsum("nd,nd->n", _normals(corners), corners[:, 0]) < 0]
    small = [np.zeros((0, 3, 3), np.float32)]
    while len(left):
        middle, longest_m = left.mean(axis=1), longest_edges(left)
        distance_m = lengths(middle.T)
        chosen = (middle @ axis + longest_m > 0) & (distance_m + longest_m > OWN_GLASS_M)
        large = chosen & (longest_m > _LARGEST * np.maximum(distance_m, OWN_GLASS_M))
        small.append(left[chosen & ~large])
        left = _quartered(left[large])
    return np.concatenate(small)


def _normals(corners: Floats) -> Floats:
    """(N, 3) normals of triangles; their length is twice the area."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.cross(b - a, c - a)


def _quartered(corners: Floats) -> Floats:
    """(4 N, 3, 3) quarters of (N, 3, 3) triangles, cut at the middles of edges."""
    a, b, c = np.moveaxis(corners, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.concatenate([np.stack(three, axis=1) for three in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])


def add_occluder(stop_m: Floats, points_m: Floats, spacing_m: float, lamp_frame: LampFrame) -> None:
    """Adds a body to a shadow map, in place.

    Light is stopped at the body's far side, so that the body does not shadow itself.

    Args:
        stop_m: (cells, cells) float32 distances of the map; changed in place.
        points_m: (N, 3) points on the body's surface.
        spacing_m: distance between neighbouring points.
        lamp_frame: position and axes of the lamp.
    """
    layout = lamp_frame.layout
    away = np.ascontiguousarray(points_m.T) - lamp_frame.place_m[:, None]
    distance_m = lengths(away)
    keep = (distance_m > OWN_GLASS_M) & (lamp_frame.frame[2] @ away > 0)
    distance_m = distance_m[keep]
    unit: Floats = away[:, keep] / distance_m
    column, row = (np.rint(place).astype(np.int64) for place in lamp_frame.places(unit))
    inside = np.minimum(column, row) >= BORDER
    inside &= np.maximum(column, row) < layout.cells - BORDER
    if not inside.any():
        return
    column, row, distance_m = column[inside], row[inside], distance_m[inside]
    top, left = int(row.min()), int(column.min())
    size = int(row.max()) - top + 1, int(column.max()) - left + 1
    ends_m = np.zeros(size, np.float32)
    np.maximum.at(ends_m.reshape(-1), (row - top) * size[1] + column - left, distance_m)
    gap = min(math.ceil(spacing_m / (layout.grain_rad * float(distance_m.min()))), _CLOSED_CELLS)
    if gap > 1:
        ends_m = cv2.morphologyEx(ends_m, cv2.MORPH_CLOSE, np.ones((gap, gap), np.uint8))
    part = stop_m[top : top + size[0], left : left + size[1]]
    np.minimum(part, np.where(ends_m > 0, ends_m - np.float32(_SOLE_M), np.float32(np.inf)), out=part)
