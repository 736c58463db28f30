"""Triangle meshes for authors: building, shaping and writing them, in NumPy.

A `Mesh` has one index per vertex (position, texture coordinate and normal together); `write_obj` quantises it so that
every machine writes the same bytes. Lengths are metres, angles degrees, faces counter-clockwise seen from outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import Polygon  # type: ignore[import-untyped]

__all__ = [
    "Mesh",
    "bevelled_box",
    "box",
    "extrude",
    "grid",
    "merge",
    "revolve",
    "rotation",
    "smooth_normals",
    "write_obj",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Ties of the rounding below would depend on the last bit of a sine; this moves them off the middle.
_TIE_BREAK = 1e-6

# What rounding to millimetres does to flat quads: how far corners are from one plane, and the textures of the two
# diagonals from each other where they cross.
_FLAT_M, _FLAT_UV = 1e-3, 1e-3


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: (N, 3) float64, metres.
        faces: (M, 3) int64 indices into `vertices`.
        uvs: (N, 2) float64, v up as in OBJ.
        normals: (N, 3) float64 unit vectors, or None to have `write_obj` make smooth ones.
    """

    vertices: Floats
    faces: Ints
    uvs: Floats
    normals: Floats | None = None

    @staticmethod
    def of(
        vertices: ArrayLike, faces: ArrayLike, uvs: ArrayLike | None = None, normals: ArrayLike | None = None
    ) -> Mesh:
        """Makes a mesh from anything array-like; missing texture coordinates are zero."""
        points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
        coordinates = np.zeros((len(points), 2)) if uvs is None else np.asarray(uvs, dtype=np.float64).reshape(-1, 2)
        directions = None if normals is None else np.asarray(normals, dtype=np.float64).reshape(-1, 3)
        return Mesh(points, np.asarray(faces, dtype=np.int64).reshape(-1, 3), coordinates, directions)

    @property
    def bounds(self) -> Floats:
        """(2, 3) lowest and highest corner."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def transformed(self, matrix: ArrayLike) -> Mesh:
        """Applies a (4, 4) or (3, 3) matrix; a mirroring one keeps the faces outward."""
        m = np.asarray(matrix, dtype=np.float64)
        linear, shift = m[:3, :3], (m[:3, 3] if m.shape == (4, 4) else np.zeros(3))
        normals = self.normals
        if normals is not None:
            normals = _unit(normals @ np.linalg.inv(linear))
        faces = self.faces[:, ::-1] if np.linalg.det(linear) < 0 else self.faces
        return Mesh(self.vertices @ linear.T + shift, faces, self.uvs, normals)

    def translated(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Mesh:
        """Moves the mesh, metres."""
        return replace(self, vertices=self.vertices + np.array([x, y, z]))

    def scaled(self, x: float, y: float | None = None, z: float | None = None) -> Mesh:
        """Scales about the origin; one number scales all axes; negative numbers mirror."""
        return self.transformed(np.diag([x, x if y is None else y, x if z is None else z]))

    def flipped(self) -> Mesh:
        """Turns the mesh inside out."""
        return replace(self, faces=self.faces[:, ::-1], normals=None if self.normals is None else -self.normals)

    def with_uvs(self, uvs: ArrayLike) -> Mesh:
        """Replaces the texture coordinates; one (2,) pair is given to every vertex."""
        return replace(self, uvs=np.broadcast_to(np.asarray(uvs, dtype=np.float64), (len(self.vertices), 2)).copy())

    def part(self, faces: Ints) -> Mesh:
        """Some of its (K, 3) faces as a mesh of their own, with the vertices that they use."""
        used, renumbered = np.unique(faces, return_inverse=True)
        normals = None if self.normals is None else self.normals[used]
        return Mesh(self.vertices[used], renumbered.reshape(-1, 3), self.uvs[used], normals)

    def face_areas(self) -> Floats:
        """(M,) areas in square metres."""
        corners = self.vertices[self.faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return np.asarray(0.5 * np.linalg.norm(cross, axis=1), dtype=np.float64)


def rotation(axis: str, degrees: float) -> Floats:
    """(3, 3) right-handed rotation about "x", "y" or "z"."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    out = np.eye(3)
    out[i, i], out[i, j], out[j, i], out[j, j] = c, -s, s, c
    return out


def merge(meshes: Sequence[Mesh]) -> Mesh:
    """One mesh of many; normals are kept if all have them and made smooth (40° crease) where some lack them."""
    if any(m.normals is not None for m in meshes):
        meshes = [m if m.normals is not None else smooth_normals(m) for m in meshes]
    offsets = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    faces = np.concatenate([m.faces + o for m, o in zip(meshes, offsets, strict=False)])
    known = [m.normals for m in meshes if m.normals is not None]
    normals = np.concatenate(known) if known else None
    return Mesh(np.concatenate([m.vertices for m in meshes]), faces, np.concatenate([m.uvs for m in meshes]), normals)


def grid(points: ArrayLike, uvs: ArrayLike | None = None, wrap: bool = False) -> Mesh:
    """A sheet of quads (two triangles each) over an (R, C, 3) lattice; outside is rows × columns by the right hand.

    Args:
        points: (R, C, 3) positions.
        uvs: (R, C, 2); by default the column runs along u and the row along v, 0 to 1.
        wrap: joins the last column to the first (a tube along the rows), sharing its vertices.
    """
    p = np.asarray(points, dtype=np.float64)
    rows, columns = p.shape[:2]
    if uvs is None:
        v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
        uvs = np.stack([u, v], axis=-1)
    index = np.arange(rows * columns).reshape(rows, columns)
    if wrap:
        index = np.concatenate([index, index[:, :1]], axis=1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, d, c], -1), np.stack([a, c, b], -1)], axis=2)
    return Mesh.of(p.reshape(-1, 3), faces, np.asarray(uvs, dtype=np.float64).reshape(-1, 2))


def revolve(profile: ArrayLike, segments: int = 32, axis: str = "z") -> Mesh:
    """Turns a (P, 2) profile of (radius, height) a full circle about an axis.

    The profile runs upwards along the axis on the outside; u goes round, v along the profile by length.
    """
    p = np.asarray(profile, dtype=np.float64)
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ring[-1] = ring[0]
    xy = p[:, None, :1] * ring[None]
    z = np.broadcast_to(p[:, None, 1:], (*xy.shape[:2], 1))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    v, u = np.meshgrid(length / length[-1], angle / (2 * np.pi), indexing="ij")
    mesh = grid(np.concatenate([xy, z], axis=-1), np.stack([u, v], -1)).flipped()
    cycle = {"z": [0, 1, 2], "x": [2, 0, 1], "y": [1, 2, 0]}[axis]
    return _without_slivers(replace(mesh, vertices=mesh.vertices[:, cycle]))


def extrude(polygon: ArrayLike, depth: float, bevel: float = 0.0) -> Mesh:
    """A (P, 2) counter-clockwise simple polygon pulled up +z by `depth`, its upper rim shrunk by an optional bevel.

    Texture coordinates are the polygon's bounding box, 0 to 1, on caps and walls alike.
    """
    p = np.asarray(polygon, dtype=np.float64)
    levels = [(0.0, 0.0), (depth, 0.0)] if bevel <= 0 else [(0.0, 0.0), (depth - bevel, 0.0), (depth, bevel)]
    rings = []
    for height, inset in levels:
        before, after = _unit(p - np.roll(p, 1, axis=0)), _unit(np.roll(p, -1, axis=0) - p)
        inward = np.stack([-(before + after)[:, 1], (before + after)[:, 0]], axis=-1)
        # A mitre: moving a corner along its bisector by inset / cos(half turn) moves both its edges by inset.
        ring = p + inset * 2 * inward / np.maximum((inward**2).sum(axis=1, keepdims=True), 0.5)
        rings.append(np.column_stack([ring, np.full(len(p), height)]))
    walls = grid(np.stack(rings)[:, [*range(len(p)), 0]]).flipped()
    triangles = np.asarray(trimesh.creation.triangulate_polygon(Polygon(rings[-1][:, :2]), engine="earcut")[1])
    top = Mesh.of(rings[-1], _wound(rings[-1], triangles))
    bottom = Mesh.of(rings[0], _wound(rings[0], triangles)).flipped()
    mesh = merge([walls, top, bottom])
    low, span = p.min(axis=0), np.ptp(p, axis=0)
    return mesh.with_uvs((mesh.vertices[:, :2] - low) / np.maximum(span, 1e-9))


def box(size: ArrayLike, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """A box of (3,) full sizes; every side has its own 0-to-1 texture square, upright on the four walls."""
    return bevelled_box(size, 0.0, 1, centre)


def bevelled_box(size: ArrayLike, bevel: float, segments: int = 2, centre: ArrayLike = (0.0, 0.0, 0.0)) -> Mesh:
    """A box of (3,) full sizes whose edges are rounded with radius `bevel` in `segments` steps (0 radius: sharp)."""
    half = np.asarray(size, dtype=np.float64) / 2
    bevel = float(min(bevel, half.min()))
    step = np.tan(np.linspace(0, np.pi / 4, segments + 1)) if bevel > 0 else np.zeros(1)
    # Grid lines of one side on the cube [-1, 1]: dense in the rounded margin, none on the flat.
    line = np.concatenate([-1.0 - step[::-1], 1.0 + step])
    a, b = np.meshgrid(line, line, indexing="ij")
    sides = []
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1)):
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        core = half - bevel
        direction = np.zeros((*a.shape, 3))
        direction[..., axis] = sign
        direction[..., i] = np.sign(a) * np.maximum(np.abs(a) - 1, 0)
        direction[..., j] = np.sign(b) * np.maximum(np.abs(b) - 1, 0)
        normals = _unit(direction.reshape(-1, 3)).reshape(direction.shape)
        base = np.zeros_like(direction)
        base[..., axis] = sign * core[axis]
        base[..., i], base[..., j] = np.sign(a) * core[i], np.sign(b) * core[j]
        points = base + bevel * normals
        across = points[..., i] / half[i] if axis != 1 else -points[..., j] / half[j]
        upward = points[..., j] / half[j] if axis != 1 else points[..., i] / half[i]
        if axis == 1:
            across, upward = points[..., 0] / half[0], points[..., 2] / half[2]
        mirrored = (axis == 0 and sign < 0) or (axis == 1 and sign > 0) or (axis == 2 and sign < 0)
        uvs = np.stack([0.5 - across / 2 if mirrored else 0.5 + across / 2, 0.5 + upward / 2], axis=-1)
        sheet = grid(points, uvs)
        side = replace(sheet, normals=normals.reshape(-1, 3))
        sides.append(side if sign > 0 else replace(side, faces=side.faces[:, ::-1]))
    return _without_slivers(merge(sides)).translated(*np.asarray(centre, dtype=np.float64))


def smooth_normals(mesh: Mesh, crease_deg: float = 40.0) -> Mesh:
    """Gives every corner the area-weighted mean normal of the faces about its position within the crease angle.

    Vertices at one position are smoothed together even if their texture coordinates differ; corners are split where
    needed.
    """
    corners = mesh.vertices[mesh.faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit = _unit(weighted)
    keys = np.floor(mesh.vertices * 1e5 + 0.5).astype(np.int64)
    _, place = np.unique(keys, axis=0, return_inverse=True)
    place = place.reshape(-1)[mesh.faces]
    order = np.argsort(place.reshape(-1), kind="stable")
    sorted_place = place.reshape(-1)[order]
    starts = np.flatnonzero(np.r_[True, sorted_place[1:] != sorted_place[:-1]])
    normals = np.zeros((len(mesh.faces) * 3, 3))
    limit = np.cos(np.radians(crease_deg))
    for members in np.split(order, starts[1:]):
        around = members // 3
        close = unit[around] @ unit[around].T >= limit - 1e-12
        normals[members] = close.astype(np.float64) @ weighted[around]
    normals = _unit(normals)
    rows = np.column_stack([mesh.faces.reshape(-1), np.floor(normals * 1e4 + 0.5).astype(np.int64)])
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    chosen = mesh.faces.reshape(-1)[first]
    return Mesh(mesh.vertices[chosen], inverse.reshape(-1, 3).astype(np.int64), mesh.uvs[chosen], normals[first])


def write_obj(path: Path, mesh: Mesh, *, is_patchwork: bool = False) -> None:
    """Writes an OBJ: positions to 1 mm, texture coordinates to 1e-4, normals to 1e-3; empty faces are left out.

    Args:
        path: of the file.
        mesh: what to write.
        is_patchwork: whether it is many small pieces rather than a few skins. Each corner is then written before the
            first face that uses it, and faces count backwards: pieces that are alike read alike, and pack smaller. Two
            neighbouring triangles that are one flat quad are written as one face, which MuJoCo cuts along the shorter
            diagonal.
    """
    if mesh.normals is None:
        mesh = smooth_normals(mesh)
    assert mesh.normals is not None
    columns = [(mesh.vertices, 1e3, "v", 3), (mesh.uvs, 1e4, "vt", 4), (mesh.normals, 1e3, "vn", 3)]
    quantised = np.floor(mesh.vertices * 1e3 + 0.5 + _TIE_BREAK)
    corners = quantised[mesh.faces]
    area = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum(axis=1)
    faces = mesh.faces[area > 0]
    used = np.unique(faces)
    texts, index = [], []
    for values, scale, tag, digits in columns:
        whole = np.floor(values * scale + 0.5 + _TIE_BREAK)
        kept, inverse = np.unique(whole[used], axis=0, return_inverse=True)
        full = np.zeros(len(values), dtype=np.int64)
        full[used] = inverse.reshape(-1) + 1
        index.append(full[faces])
        text = {number: _number(number / scale, digits) for number in np.unique(kept).tolist()}
        texts.append([" ".join([tag, *(text[number] for number in row)]) for row in kept.tolist()])
    table = np.stack(index, -1)
    if is_patchwork:
        number = np.zeros((len(mesh.vertices), 3), dtype=np.int64)
        number[faces] = table
        pieces = _quads_and_triangles(faces, quantised / 1e3, mesh.uvs)
        lines = list(_as_needed(texts, [number[piece].tolist() for piece in pieces]))
    else:
        lines = [line for text in texts for line in text]
        lines += ["f " + " ".join("/".join(map(str, corner)) for corner in face) for face in table.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def _quads_and_triangles(faces: Ints, positions: Floats, uvs: Floats) -> list[list[int]]:
    """Corners of faces, with each two that follow each other joined where they are one flat, convex quad.

    Args:
        faces: (M, 3) indices.
        positions, uvs: (N, 3) and (N, 2) of what they index. A joined quad's texture lies on it without a bend, alike
            along whichever diagonal a reader cuts it.
    """
    first, second = faces[:-1], faces[1:]
    quads, is_quad = np.zeros((len(first), 4), dtype=np.int64), np.zeros(len(first), dtype=np.bool_)
    for i in range(3):
        for j in range(3):
            meets = (first[:, i] == second[:, (j + 1) % 3]) & (first[:, (i + 1) % 3] == second[:, j])
            around = (first[:, i], second[:, (j + 2) % 3], first[:, (i + 1) % 3], first[:, (i + 2) % 3])
            quads[meets] = np.stack(around, axis=1)[meets]
            is_quad |= meets
    corners, places = positions[quads], uvs[quads]
    edges = np.roll(corners, -1, axis=1) - corners
    turns = np.cross(np.roll(edges, 1, axis=1), edges)
    area = np.linalg.norm(turns, axis=2)
    normal = turns[:, 0] / np.maximum(area[:, :1], 1e-12)
    is_quad &= (np.einsum("kij,kj->ki", turns, normal) > 0.999 * area).all(axis=1) & (area > 0).all(axis=1)
    is_quad &= np.abs(np.einsum("kj,kj->k", corners[:, 2] - corners[:, 0], normal)) < _FLAT_M
    # Where its diagonals cross, both are to have the same place in the texture.
    share = _share_of_diagonal(corners)
    odd = places[:, 0] + share[:, :1] * (places[:, 2] - places[:, 0])
    even = places[:, 1] + share[:, 1:] * (places[:, 3] - places[:, 1])
    is_quad &= (np.abs(odd - even) < _FLAT_UV).all(axis=1)
    pieces, number, joins, quad_list = [], 0, is_quad.tolist(), quads.tolist()
    triangles = faces.tolist()
    while number < len(triangles):
        joined = number < len(joins) and joins[number]
        pieces.append(quad_list[number] if joined else triangles[number])
        number += 2 if joined else 1
    return pieces


def _share_of_diagonal(corners: Floats) -> Floats:
    """(K, 2) where the diagonals of flat quads (K, 4, 3) cross, as shares of their lengths."""
    one, other = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    between = corners[:, 1] - corners[:, 0]
    a, b, c = (one * one).sum(1), (one * other).sum(1), (other * other).sum(1)
    d, e = (one * between).sum(1), (other * between).sum(1)
    span = np.maximum(a * c - b * b, 1e-12)
    return np.stack([(d * c - b * e) / span, (d * b - a * e) / span], axis=1)


def _as_needed(texts: list[list[str]], faces: list[list[list[int]]]) -> Iterator[str]:
    """Lines of an OBJ, each entry before its first face, faces counting back from the newest entry.

    Args:
        texts: lines of positions, texture coordinates and normals.
        faces: for each corner of each face the numbers, from 1, of its position, texture coordinates and normal.
    """
    places: list[dict[int, int]] = [{} for _ in texts]
    for face in faces:
        for corner in face:
            for number, text, place in zip(corner, texts, places, strict=True):
                if number not in place:
                    place[number] = len(place)
                    yield text[number - 1]
        yield "f " + " ".join(
            "/".join(str(place[number] - len(place)) for number, place in zip(corner, places, strict=True))
            for corner in face
        )


def _number(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _unit(v: Floats) -> Floats:
    out: Floats = v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)
    return out


def _wound(ring: Floats, triangles: Ints) -> Ints:
    a, b, c = (ring[triangles[:, k], :2] for k in range(3))
    turn = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    return np.where(turn[:, None] < 0, triangles[:, ::-1], triangles)


def _without_slivers(mesh: Mesh) -> Mesh:
    return replace(mesh, faces=mesh.faces[mesh.face_areas() > 1e-10])
