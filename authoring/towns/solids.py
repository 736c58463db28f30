"""Shapes from plans, added to a kit `Sink`: flat polygons, walls along lines, strips along streets, boxes."""

from __future__ import annotations

from itertools import pairwise

import mapbox_earcut
import numpy as np
import numpy.typing as npt
from shapely.geometry import Point, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.geometry.polygon import orient  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.materials import MATERIALS
from authoring.towns import paths
from authoring.towns.regions import polygons

Array = npt.NDArray[np.float64]
CELL_M = 110.0


def tile_m_of(material: str) -> float:
    """Returns the metres that UV 0..1 covers; 1 for materials without a tiling texture."""
    return (MATERIALS[material].tile_m if material in MATERIALS else 0.0) or 1.0


def flat(sink: Sink, shape: BaseGeometry, z_m: float, material: str, label: str, *, cell_m: float = CELL_M) -> None:
    """Add a level surface, cut along a grid so that no triangle spans half the town."""
    tile_m = tile_m_of(material)
    for polygon in polygons(shape):
        for piece in _cells(polygon, cell_m):
            points, faces = triangulate(piece)
            vertices = np.column_stack([points, np.full(len(points), z_m)])
            normals = np.broadcast_to((0.0, 0.0, 1.0), vertices.shape)
            sink.triangles(material, vertices, faces, uvs=points / tile_m, normals=normals, label=label)


def triangulate(polygon: Polygon) -> tuple[Array, npt.NDArray[np.int64]]:
    """Points (N, 2) and counter-clockwise triangles (M, 3) of a polygon with holes."""
    rings = [np.asarray(orient(polygon).exterior.coords)[:-1, :2]]
    rings += [np.asarray(hole.coords)[:-1, :2] for hole in orient(polygon).interiors]
    points = np.round(np.concatenate(rings), 3)
    ends = np.cumsum([len(ring) for ring in rings]).astype(np.uint32)
    faces = mapbox_earcut.triangulate_float64(points, ends).reshape(-1, 3).astype(np.int64)
    corner = points[faces]
    first, second = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    faces[area < 0] = faces[area < 0][:, ::-1]
    return points, faces[np.abs(area) > 1e-6]


def wall(sink: Sink, line: Array, low_m: npt.ArrayLike, high_m: npt.ArrayLike, material: str, label: str) -> None:
    """Add a vertical sheet along a line (N, 2), seen from the right of the line's direction."""
    low, high = (np.broadcast_to(np.asarray(z, np.float64), len(line)) for z in (low_m, high_m))
    steps = np.diff(line, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    tile_m = tile_m_of(material)
    for index in range(len(steps)):
        if lengths[index] < 1e-4:
            continue
        normal = np.array([steps[index, 1], -steps[index, 0], 0.0]) / lengths[index]
        a, b = index, index + 1
        corners = np.array([[*line[a], low[a]], [*line[b], low[b]], [*line[b], high[b]], [*line[a], high[a]]])
        uvs = np.array([[along[a], low[a]], [along[b], low[b]], [along[b], high[b]], [along[a], high[a]]]) / tile_m
        faces = [(0, 1, 2), (0, 2, 3)]
        sink.triangles(material, corners, faces, uvs=uvs, normals=np.tile(normal, (4, 1)), label=label)


def ribbon(sink: Sink, left: Array, right: Array, material: str, label: str, *, uvs: Array | None = None) -> None:
    """Add a strip between two lines (N, 3) of equally many points, seen from above.

    UVs (2N, 2), of the left line and then the right, lie in the plane unless they are given.
    """
    tile_m = tile_m_of(material)
    count = len(left)
    vertices = np.concatenate([left, right])
    index = np.arange(count - 1)
    faces = np.concatenate(
        [
            np.stack([index, index + count, index + count + 1], 1),
            np.stack([index, index + count + 1, index + 1], 1),
        ]
    )
    along = np.gradient((left + right) / 2, axis=0)
    across = right - left
    normals = np.cross(across, along)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    uvs = vertices[:, :2] / tile_m if uvs is None else uvs
    sink.triangles(material, vertices, faces, uvs=uvs, normals=np.concatenate([normals, normals]), label=label)


def boundary_towards(land: Polygon, road: BaseGeometry, *, reach_m: float = 0.06) -> list[Array]:
    """The stretches of a polygon's rim that run along `road`, with the land on their left."""
    near = road.buffer(reach_m)
    stretches: list[Array] = []
    for ring in (orient(land).exterior, *orient(land).interiors):
        points = np.asarray(ring.coords)[:, :2]
        middles = (points[:-1] + points[1:]) / 2
        touching = [bool(near.contains(Point(*middle))) for middle in middles]
        current: list[Array] = []
        for index, touches in enumerate(touching):
            if touches:
                current = current or [points[index]]
                current.append(points[index + 1])
            elif current:
                stretches.append(np.asarray(current))
                current = []
        if current:
            if stretches and touching[0] and not all(touching):
                stretches[0] = np.concatenate([np.asarray(current)[:-1], stretches[0]])
            else:
                stretches.append(np.asarray(current))
    return stretches


def _cells(polygon: Polygon, cell_m: float) -> list[Polygon]:
    x0, y0, x1, y1 = np.asarray(polygon.bounds)
    columns = range(int(np.floor(x0 / cell_m)), int(np.floor(x1 / cell_m)) + 1)
    rows = range(int(np.floor(y0 / cell_m)), int(np.floor(y1 / cell_m)) + 1)
    pieces: list[Polygon] = []
    for column in columns:
        for row in rows:
            cell = box(column * cell_m, row * cell_m, (column + 1) * cell_m, (row + 1) * cell_m)
            pieces.extend(polygons(polygon.intersection(cell), min_area_m2=1e-4))
    return pieces


def sweep(
    sink: Sink,
    line: Array,
    heights: npt.ArrayLike,
    section: npt.ArrayLike,
    material: str,
    label: str,
    *,
    swatch: str | None = None,
) -> None:
    """Add the sheet that a cross-section draws along a line.

    Args:
        line: (N, 2) in the plane.
        heights: (N,) heights of the line.
        section: (K, 2) of (offset to the left, height above the line); seen from above if it runs leftwards.
        material: tiling material, its UVs along the line and along the section in metres.
        swatch: a palette colour instead of the material.
    """
    outline, z = np.asarray(section, np.float64), np.broadcast_to(np.asarray(heights, np.float64), len(line))
    along = paths.stations(line)
    tile_m = tile_m_of(material)
    across = 0.0
    for (offset_a, rise_a), (offset_b, rise_b) in pairwise(outline):
        right = np.column_stack([paths.offset(line, offset_a), z + rise_a])
        left = np.column_stack([paths.offset(line, offset_b), z + rise_b])
        step = float(np.hypot(offset_b - offset_a, rise_b - rise_a))
        normals = np.cross(np.gradient(right, axis=0), left - right)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        index = np.arange(len(line) - 1)
        count = len(line)
        faces = np.concatenate(
            [
                np.stack([index, index + 1, index + count + 1], 1),
                np.stack([index, index + count + 1, index + count], 1),
            ]
        )
        vertices = np.concatenate([right, left])
        both = np.concatenate([normals, normals])
        if swatch:
            sink.swatch_mesh(swatch, vertices, faces, both, label=label)
        else:
            uvs = np.concatenate(
                [
                    np.column_stack([along, np.full(count, across)]),
                    np.column_stack([along, np.full(count, across + step)]),
                ]
            )
            sink.triangles(material, vertices, faces, uvs=uvs / tile_m, normals=both, label=label)
        across += step


def railing(
    sink: Sink,
    line: Array,
    heights: npt.ArrayLike,
    swatch: str,
    label: str,
    *,
    top_m: float = 1.05,
    post_m: float = 2.0,
) -> None:
    """Add posts and three rails along a line."""
    dense = paths.densified(line, post_m)
    z = np.interp(
        paths.stations(dense), paths.stations(line), np.broadcast_to(np.asarray(heights, np.float64), len(line))
    )
    for level, half in ((top_m, 0.03), (top_m * 0.62, 0.015), (top_m * 0.25, 0.015)):
        section = [(-half, level - half), (-half, level + half), (half, level + half), (half, level - half)]
        sweep(sink, dense, z, section[::1], "palette", label, swatch=swatch)
    for point, low in zip(dense, z, strict=True):
        x, y = point
        sink.swatch_box(swatch, (x - 0.03, y - 0.03, low), (x + 0.03, y + 0.03, low + top_m), skip="zZ", label=label)
