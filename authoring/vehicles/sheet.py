"""A triangulated patch into which outlines are cut exactly; the faces inside an outline get a material."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from authoring.mesh import Floats, Ints, Mesh, grid
from authoring.vehicles.patches import Patch

__all__ = ["Sheet", "lattice"]

Field = Callable[[Floats, Floats], Floats]
"""(points (N, 3), params (N, 2)) -> (N,) signed distance in metres, negative inside."""


@dataclass
class Sheet:
    """Triangles over a patch.

    Attributes:
        patch: the surface every vertex lies on.
        params: (N, 2) patch parameters.
        faces: (M, 3) vertex indices.
        material: (M,) name of each face's part.
    """

    patch: Patch
    params: Floats
    faces: Ints
    material: list[str]
    _points: Floats | None = field(default=None, repr=False)

    @property
    def points(self) -> Floats:
        """(N, 3) positions, metres."""
        if self._points is None or len(self._points) != len(self.params):
            self._points = self.patch.evaluate(self.params)
        return self._points

    def stamp(
        self,
        shape: Field,
        material: str,
        *,
        where: Field | None = None,
        on: tuple[str, ...] | None = None,
        finest_m: float = 0.03,
        bend_m: float = 0.005,
    ) -> Sheet:
        """Cuts the outline of `shape` and names what lies inside.

        Args:
            shape: the signed distance.
            material: the name given inside.
            where: a second signed distance; faces whose middle is outside it stay as they are.
            on: only faces of these materials change (and are cut).
            finest_m: edges across the outline are first halved where the outline bends, down to this length.
            bend_m: how far a straight cut through a face may miss the outline.
        """

        def value(params: Floats) -> Floats:
            return shape(self.patch.evaluate(params), params)

        for _ in range(6):
            if not self._refine(value, finest_m, bend_m, where, on):
                break
        self._split(value, where, on)
        middle = self.params[self.faces].mean(axis=1)
        points = self.patch.evaluate(middle)
        inside = shape(points, middle) < 0
        if where is not None:
            inside &= where(points, middle) < 0
        self.material = [
            material if hit and (on is None or old in on) else old
            for hit, old in zip(inside.tolist(), self.material, strict=True)
        ]
        return self

    def cut(self, line: Field, *, where: Field | None = None, on: tuple[str, ...] | None = None) -> Sheet:
        """Cuts along the zero of `line` and names nothing: before a stamp narrower than the faces it falls on."""
        self._split(lambda params: line(self.patch.evaluate(params), params), where, on)
        return self

    def faces_of(self, *materials: str) -> Ints:
        """(K, 3) faces of the named parts."""
        return self.faces[np.isin(np.array(self.material), materials)]

    def part(self, material: str, sink_m: float = 0.0) -> Mesh:
        """The faces of one material as a mesh with the patch's normals, moved inwards by `sink_m`."""
        if material not in self.material:
            return Mesh.of(np.zeros((0, 3)), np.zeros((0, 3)))
        return self._mesh(self.faces_of(material), sink_m)

    def walls(self, material: str, sink_m: float, margin_m: float = 0.0) -> Mesh:
        """The rim that joins a part sunk by `part(material, sink_m)` with what stands around it."""
        edges = self.border(material)
        points, normals = self.points, self.patch.normals(self.params)
        a, b = points[edges[:, 0]], points[edges[:, 1]]
        na, nb = normals[edges[:, 0]], normals[edges[:, 1]]
        deep_a, deep_b = a - na * sink_m, b - nb * sink_m
        corners = np.stack([a + na * margin_m, b + nb * margin_m, deep_b, deep_a], axis=1).reshape(-1, 3)
        base = np.arange(len(edges))[:, None] * 4
        faces = np.concatenate([base + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
        return Mesh.of(corners, faces)

    def border(self, material: str) -> Ints:
        """(E, 2) directed edges of a part that face another part (the sheet's own rim is not among them)."""
        names = np.array(self.material)
        half = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        owner = np.tile(np.arange(len(self.faces)), 3)
        inside = names[owner] == material
        other = {(int(a), int(b)) for (a, b), hit in zip(half, inside, strict=True) if not hit}
        own = [(int(a), int(b)) for (a, b), hit in zip(half, inside, strict=True) if hit]
        return np.array([(a, b) for a, b in own if (b, a) in other], dtype=np.int64).reshape(-1, 2)

    def _mesh(self, faces: Ints, sink_m: float) -> Mesh:
        used, inverse = np.unique(faces, return_inverse=True)
        normals = self.patch.normals(self.params[used])
        points = self.points[used] - normals * sink_m
        return Mesh.of(points, inverse.reshape(-1, 3), self.params[used], normals)

    def _active(self, params: Floats, where: Field | None, on: tuple[str, ...] | None) -> np.ndarray:
        active = np.ones(len(self.faces), dtype=bool) if on is None else np.isin(np.array(self.material), on)
        if where is not None:
            corners = where(self.patch.evaluate(params), params)[self.faces]
            active &= (corners < 0).any(axis=1)
        return active

    def _refine(
        self,
        value: Callable[[Floats], Floats],
        finest_m: float,
        bend_m: float,
        where: Field | None,
        on: tuple[str, ...] | None,
    ) -> bool:
        """Halves edges of crossed faces where the outline bends between their ends; returns whether there were any."""
        half = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        edges, inverse = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True)
        level, between = value(self.params), value(self.params[edges].mean(axis=1))
        inside = np.concatenate([level[self.faces], between[inverse.reshape(3, -1)].T], axis=1) < 0
        crossed = inside.any(axis=1) & ~inside.all(axis=1) & self._active(self.params, where, on)
        bends = np.abs(between - level[edges].mean(axis=1)) > bend_m
        length = np.linalg.norm(self.points[edges[:, 0]] - self.points[edges[:, 1]], axis=1)
        touched = np.zeros(len(edges), dtype=bool)
        touched[inverse.reshape(3, -1)[:, crossed]] = True
        chosen = touched & bends & (length > 2 * finest_m)
        if not chosen.any():
            return False
        self._insert(edges[chosen], np.full(int(chosen.sum()), 0.5))
        return True

    def _split(self, value: Callable[[Floats], Floats], where: Field | None, on: tuple[str, ...] | None) -> None:
        level = value(self.params)
        active = self._active(self.params, where, on)
        half = np.concatenate([self.faces[:, [0, 1]], self.faces[:, [1, 2]], self.faces[:, [2, 0]]])
        edges = np.unique(np.sort(half[np.tile(active, 3)], axis=1), axis=0)
        a, b = level[edges[:, 0]], level[edges[:, 1]]
        crossing = ((a < 0) != (b < 0)) & (np.minimum(np.abs(a), np.abs(b)) > 1e-3)
        edges, a, b = edges[crossing], a[crossing], b[crossing]
        if not len(edges):
            return
        low, high = np.zeros(len(edges)), np.ones(len(edges))
        start, along = self.params[edges[:, 0]], self.params[edges[:, 1]] - self.params[edges[:, 0]]
        for _ in range(12):
            middle = (low + high) / 2
            same = (value(start + middle[:, None] * along) < 0) == (a < 0)
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        self._insert(edges, (low + high) / 2)

    def _insert(self, edges: Ints, at: Floats) -> None:
        """Puts a vertex on each undirected edge, at a fraction of it, and retriangulates the faces about."""
        count = len(self.params)
        new = self.params[edges[:, 0]] + at[:, None] * (self.params[edges[:, 1]] - self.params[edges[:, 0]])
        self.params = np.concatenate([self.params, new])
        key = {(int(a), int(b)): count + i for i, (a, b) in enumerate(edges)}
        faces: list[tuple[int, int, int]] = []
        material: list[str] = []
        positions = self.patch.evaluate(self.params)
        self._points = positions
        for face, name in zip(self.faces.tolist(), self.material, strict=True):
            middle = [key.get((min(face[k], face[(k + 1) % 3]), max(face[k], face[(k + 1) % 3]))) for k in range(3)]
            pieces = _retriangulate(face, middle, positions)
            faces += pieces
            material += [name] * len(pieces)
        self.faces, self.material = np.array(faces, dtype=np.int64), material


def _retriangulate(face: list[int], middle: list[int | None], points: Floats) -> list[tuple[int, int, int]]:
    """Splits a triangle whose side k (from corner k to k + 1) may carry the vertex middle[k]."""
    carried = [k for k in range(3) if middle[k] is not None]
    if not carried:
        return [(face[0], face[1], face[2])]
    # Turn the face so that with one vertex it is on side 0, with two the bare side is side 2.
    turn = carried[0] if len(carried) == 1 else ([k for k in range(3) if middle[k] is None] or [2])[0] + 1
    a, b, c = (face[(turn + k) % 3] for k in range(3))
    p, q, r = (middle[(turn + k) % 3] for k in range(3))
    if len(carried) == 1:
        assert p is not None
        return [(a, p, c), (p, b, c)]
    assert p is not None and q is not None
    if r is not None:
        return [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
    if np.linalg.norm(points[a] - points[q]) <= np.linalg.norm(points[p] - points[c]):
        return [(p, b, q), (a, p, q), (a, q, c)]
    return [(p, b, q), (a, p, c), (p, q, c)]


def lattice(patch: Patch, u_lines: Floats, v_lines: Floats, material: str) -> Sheet:
    """A sheet of two triangles per cell of a parameter lattice."""
    u, v = np.meshgrid(u_lines, v_lines, indexing="ij")
    params = np.stack([u, v], axis=-1)
    mesh = grid(np.concatenate([params, np.zeros((*u.shape, 1))], axis=-1))
    faces = mesh.faces if patch.outward > 0 else mesh.faces[:, ::-1]
    sheet = Sheet(patch, params.reshape(-1, 2), faces, [material] * len(faces))
    # Cells that the patch pinches to nothing (a cap's corners) have no area and no normal.
    corners = sheet.points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sheet.faces = faces[area > 1e-9]
    sheet.material = [material] * len(sheet.faces)
    return sheet
