"""Shut lines as relief: narrow V-shaped grooves cut into a painted skin where its panels meet.

A line is drawn in one of four projections and falls on all that faces that way, both sides alike, from view to view of
the paint map without a seam. Along it the faces are cut at both lips and at the bottom; the bottom sinks, and its
normals lean so far that each wall catches another part of the sky, as rolled edges of sheet metal do. Outlines stay
where they were: a groove ends just before the edge of its panel, so nothing opens there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely  # type: ignore[import-untyped]
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from authoring.mesh import Floats, Ints, Mesh, merge

__all__ = ["DEPTH_M", "HALF_WIDTH_M", "Line", "carve"]

Line = tuple[tuple[float, float], ...]

HALF_WIDTH_M = 0.006
DEPTH_M = 0.007
_LEAN = np.radians(58)
_MARGIN_M = 1.5 * HALF_WIDTH_M + 0.001
_SHORTEST_M = 0.03
_SMALLEST_M2 = 0.12
"""Smallest area of connected faces that get grooves, square metres; mirrors and handles are smaller and get none."""
_FACING = 0.28
_GRID_M, _HAIRLINE_M = 1e-7, 0.002
_SLIVER_M2 = 1e-9


@dataclass(frozen=True)
class _View:
    """A projection.

    Attributes:
        axes: numbers of the two axes in the plane of the projection.
        along: number of the axis of the projection.
        sign: +1 if it shows the faces whose normals point along that axis, -1 for the opposite direction.
    """

    axes: list[int]
    along: int
    sign: float


_VIEWS = (
    (_View([0, 2], 1, 1.0), "side"),
    (_View([0, 2], 1, -1.0), "side"),
    (_View([0, 1], 2, 1.0), "top"),
    (_View([1, 2], 0, 1.0), "front"),
    (_View([1, 2], 0, -1.0), "rear"),
)


@dataclass(frozen=True)
class _Panel:
    """Connected faces that are visible in a projection, as triangles in its plane.

    Attributes:
        faces: (K,) indices into the mesh.
        corners: (K, 3, 2) corners in the projection, metres.
        triangles: (K,) polygons.
    """

    faces: Ints
    corners: Floats
    triangles: npt.NDArray[np.object_]


@dataclass(frozen=True)
class _Cut:
    """The pieces that replace a face.

    Attributes:
        face: index of the face in the mesh.
        pieces: the pieces; those of the groove lie below the surface.
        is_groove: (M,) whether each piece belongs to the groove.
    """

    face: int
    pieces: Mesh
    is_groove: npt.NDArray[np.bool_]


def carve(mesh: Mesh, lines: Mapping[str, Sequence[Line]], shade: Floats) -> Mesh:
    """Cuts grooves into a skin.

    Args:
        mesh: the skin, with normals and texture coordinates.
        lines: by projection, `side` (x, z), `top` (x, |y|), `front` and `rear` (|y|, z): polylines in metres.
        shade: (2, 2) texture coordinates of a groove's lips and of its bottom: its walls show what lies between.
    """
    is_groove = np.zeros(len(mesh.faces), dtype=bool)
    for view, name in _VIEWS:
        drawn = shapely.union_all([shapely.LineString(line) for line in lines.get(name, ())])
        if drawn.is_empty:
            continue
        if 1 in view.axes:
            mirror = shapely.transform(drawn, lambda p: p * [-1 if axis == 1 else 1 for axis in view.axes])  # noqa: B023
            drawn = shapely.union_all([drawn, mirror])
        panels = _panels(mesh, view, is_groove)
        cuts = [cut for panel in panels for cut in _cuts(mesh, panel, view, drawn, shade)]
        untouched = np.ones(len(mesh.faces), dtype=bool)
        untouched[[cut.face for cut in cuts]] = False
        is_groove = np.concatenate([is_groove[untouched], *(cut.is_groove for cut in cuts)])
        # Not `part`, which would renumber the vertices. Unused vertices are left out in the file.
        rest = Mesh(mesh.vertices, mesh.faces[untouched], mesh.uvs, mesh.normals)
        mesh = merge([rest, *(cut.pieces for cut in cuts)])
    return mesh


def _panels(mesh: Mesh, view: _View, is_groove: npt.NDArray[np.bool_]) -> list[_Panel]:
    """Returns the connected faces that are visible in a projection, without grooves."""
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    chosen = np.flatnonzero((normals[:, view.along] * view.sign > _FACING) & ~is_groove)
    if not len(chosen):
        return []
    flat = corners[chosen][..., view.axes]
    _, place = np.unique(np.rint(mesh.vertices * 4e3).astype(np.int64), axis=0, return_inverse=True)
    nodes = place.reshape(-1)[mesh.faces[chosen]]
    links = np.concatenate([nodes[:, :2], nodes[:, 1:]])
    count = int(place.max()) + 1
    joined = coo_matrix((np.ones(len(links)), links.T), shape=(count, count))
    label = connected_components(joined, directed=False)[1][nodes[:, 0]]
    triangles = shapely.polygons(flat)
    panels = []
    for piece in np.unique(label):
        own = label == piece
        if shapely.area(triangles[own]).sum() > _SMALLEST_M2:
            panels.append(_Panel(chosen[own], flat[own], triangles[own]))
    return panels


def _shares(points: Floats, corners: Floats) -> Floats:
    """(N, 3) barycentric coordinates of (N, 2) points in a (3, 2) triangle."""
    first, edges = corners[0], np.column_stack([corners[1] - corners[0], corners[2] - corners[0]])
    rest = np.linalg.solve(edges, (points - first).T).T
    return np.column_stack([1 - rest.sum(axis=1), rest])


def _cuts(mesh: Mesh, panel: _Panel, view: _View, drawn: shapely.Geometry, shade: Floats) -> list[_Cut]:
    """Cuts the faces of a panel at its grooves."""
    # Where sheets meet vertex by vertex but for a few, hairlines stay between them: they are no edges of a panel.
    whole = shapely.union_all(panel.triangles, grid_size=_GRID_M).buffer(_HAIRLINE_M, join_style="mitre")
    inner = whole.buffer(-_HAIRLINE_M - _MARGIN_M, join_style="mitre")
    parts = shapely.get_parts(shapely.line_merge(shapely.union_all([drawn.intersection(inner)])))
    bottom = shapely.union_all([part for part in parts if part.length > _SHORTEST_M])
    if bottom.is_empty:
        return []
    band = bottom.buffer(HALF_WIDTH_M, cap_style="square", join_style="mitre", mitre_limit=3.0)
    knives = shapely.union_all([bottom, band.boundary, *_end_walls(bottom)])
    shapely.prepare(band)
    crossed = np.flatnonzero(shapely.intersects(panel.triangles, band)).tolist()
    return [_cut(mesh, panel, k, view, bottom, band, knives, shade) for k in crossed]


def _end_walls(bottom: shapely.Geometry) -> list[shapely.Geometry]:
    """Returns the edges from the end of a bottom to the corners of the band around it, which bound the slope at the
    end.
    """
    lines = [shapely.get_coordinates(line) for line in shapely.get_parts(bottom)]
    ends = [(line[0], line[1]) for line in lines] + [(line[-1], line[-2]) for line in lines]
    walls = []
    for end, before in ends:
        if sum(np.allclose(end, other, atol=1e-6) for other, _ in ends) > 1:
            continue
        ahead = HALF_WIDTH_M * (end - before) / np.linalg.norm(end - before)
        across = np.array([-ahead[1], ahead[0]])
        walls += [shapely.LineString([end, end + ahead + across]), shapely.LineString([end, end + ahead - across])]
    return walls


def _cut(
    mesh: Mesh, panel: _Panel, k: int, view: _View, bottom: shapely.Geometry, band: shapely.Geometry,
    knives: shapely.Geometry, shade: Floats,
) -> _Cut:  # fmt: skip
    """Cuts a panel's face k: at the band's outline, at the bottom and up its ends."""
    triangle, corners, face = panel.triangles[k], panel.corners[k], mesh.faces[panel.faces[k]]
    assert mesh.normals is not None
    noded = shapely.union_all([triangle.boundary, knives.intersection(triangle)], grid_size=_GRID_M)
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    flat = np.concatenate(
        [shapely.get_coordinates(shapely.get_parts(shapely.constrained_delaunay_triangles(c))).reshape(-1, 4, 2)[:, :3]
         for c in cells]
    )  # fmt: skip
    turned = _areas(flat) * _areas(corners[None]) < 0
    flat = np.where(turned[:, None, None], flat[:, ::-1], flat)[np.abs(_areas(flat)) > _SLIVER_M2]
    shares = _shares(flat.reshape(-1, 2), corners)
    points, uvs = shares @ mesh.vertices[face], shares @ mesh.uvs[face]
    normals = shares @ mesh.normals[face]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    away = shapely.distance(bottom, shapely.points(flat.reshape(-1, 2)))
    depth = DEPTH_M * np.clip(1 - away / HALF_WIDTH_M, 0, 1)
    middles = flat.mean(axis=1)
    inside = shapely.contains(band, shapely.points(middles))
    depth *= np.repeat(inside, 3)
    share = (depth / DEPTH_M)[:, None]
    uvs = np.where(np.repeat(inside, 3)[:, None], (1 - share) * shade[0] + share * shade[1], uvs)
    points = points - depth[:, None] * normals
    down = _downhill(middles, bottom, view, mesh.vertices[face])
    lean = _LEAN * share
    normals = np.cos(lean) * normals + np.sin(lean) * np.repeat(down, 3, axis=0)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    pieces = Mesh(points, np.arange(len(points)).reshape(-1, 3), uvs, normals)
    return _Cut(int(panel.faces[k]), pieces, inside)


def _areas(corners: Floats) -> Floats:
    """(N,) signed areas of (N, 3, 2) triangles."""
    a, b = (corners[:, k] - corners[:, 0] for k in (1, 2))
    return np.asarray((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)


def _downhill(middles: Floats, bottom: shapely.Geometry, view: _View, corners: Floats) -> Floats:
    """(N, 3) unit vectors in a face's plane, from (N, 2) places in the projection towards the bottom."""
    nearest = shapely.get_coordinates(shapely.shortest_line(shapely.points(middles), bottom)).reshape(-1, 2, 2)[:, 1]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    out = np.zeros((len(middles), 3))
    out[:, view.axes] = nearest - middles
    out[:, view.along] = -(out @ normal) / normal[view.along]
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12))
