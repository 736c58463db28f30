"""The result of a generator: meshes by material and label, and the sink that collects them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from authoring.materials.palette import swatch_rect
from authoring.mesh import Mesh

Array = npt.NDArray[np.float64]
PALETTE = "palette"


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One mesh of one material and one semantic label.

    Attributes:
        material: a name in `authoring.materials.MATERIALS`.
        label: a semantic label of docs/reference/mjcf.md (`building`, `pole`, ...).
        mesh: triangles with one normal and one UV a vertex, in metres.
    """

    material: str
    label: str
    mesh: Mesh


@dataclass(slots=True)
class _Bucket:
    vertices: list[Array] = field(default_factory=list)
    normals: list[Array] = field(default_factory=list)
    uvs: list[Array] = field(default_factory=list)
    faces: list[npt.NDArray[np.int64]] = field(default_factory=list)
    count: int = 0


class Sink:
    """Collects triangles by (material, label) and makes `Part`s of them.

    Everything is in the object's own frame: metres, z up. Faces wind counter-clockwise seen from outside.
    """

    def __init__(self, label: str) -> None:
        self.label = label
        self._buckets: dict[tuple[str, str], _Bucket] = {}

    def triangles(
        self,
        material: str,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        uvs: npt.ArrayLike,
        normals: npt.ArrayLike,
        label: str | None = None,
    ) -> None:
        """Add vertices (N, 3), normals (N, 3), uvs (N, 2) and faces (M, 3) that index them."""
        points = np.asarray(vertices, np.float64)
        bucket = self._buckets.setdefault((material, label or self.label), _Bucket())
        bucket.vertices.append(points)
        bucket.normals.append(np.asarray(normals, np.float64))
        bucket.uvs.append(np.asarray(uvs, np.float64))
        bucket.faces.append(np.asarray(faces, np.int64) + bucket.count)
        bucket.count += len(points)

    def polygon(self, material: str, corners: npt.ArrayLike, uvs: npt.ArrayLike, *, label: str | None = None) -> None:
        """Add one flat convex polygon: corners (K, 3) counter-clockwise from outside, uvs (K, 2)."""
        points = np.asarray(corners, np.float64)
        normal = _newell(points)
        faces = [(0, i, i + 1) for i in range(1, len(points) - 1)]
        self.triangles(material, points, faces, uvs=uvs, normals=np.broadcast_to(normal, points.shape), label=label)

    def quad(
        self, material: str, corners: Sequence[Sequence[float]] | Array, *, tile_m: float, label: str | None = None
    ) -> None:
        """Add a quad whose tiling material is laid out in metres: u along its first edge, v up its last."""
        points = np.asarray(corners, np.float64)
        self.polygon(material, points, planar_uvs(points, tile_m), label=label)

    def swatch_quad(self, swatch: str, corners: npt.ArrayLike, *, label: str | None = None) -> None:
        """Add a quad of one plain colour of the palette."""
        points = np.asarray(corners, np.float64)
        self.polygon(PALETTE, points, _swatch_uvs(swatch, len(points)), label=label)

    def swatch_mesh(
        self,
        swatch: str,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        normals: npt.ArrayLike,
        *,
        label: str | None = None,
    ) -> None:
        """Add a mesh of one plain colour of the palette."""
        points = np.asarray(vertices, np.float64)
        low, high = np.asarray(swatch_rect(swatch)).reshape(2, 2)
        span = points.max(0) - points.min(0)
        spread = (points - points.min(0)) / max(float(span.max()), 1e-6)
        uvs = low + (high - low) * np.stack([(spread[:, 0] + spread[:, 1]) / 2, spread[:, 2]], 1)
        self.triangles(PALETTE, points, faces, uvs=uvs, normals=normals, label=label)

    def swatch_box(
        self,
        swatch: str,
        low: Sequence[float],
        high: Sequence[float],
        *,
        skip: str = "",
        label: str | None = None,
    ) -> None:
        """Add an axis-aligned box; `skip` names faces to leave out, of `-x +x -y +y -z +z` written as `xXyYzZ`."""
        for face, corners in box_faces(low, high).items():
            if face not in skip:
                self.swatch_quad(swatch, corners, label=label)

    def tiled_box(
        self,
        material: str,
        low: Sequence[float],
        high: Sequence[float],
        *,
        tile_m: float,
        skip: str = "",
        label: str | None = None,
    ) -> None:
        """Add an axis-aligned box of a tiling material laid out in metres."""
        for face, corners in box_faces(low, high).items():
            if face not in skip:
                points = np.asarray(corners)
                self.polygon(material, points, world_uvs(points, tile_m), label=label)

    def extend(self, parts: Iterable[Part]) -> None:
        """Add finished parts."""
        for part in parts:
            mesh = part.mesh
            self.triangles(
                part.material, mesh.vertices, mesh.faces, uvs=mesh.uvs, normals=_normals(mesh), label=part.label
            )

    def parts(self) -> list[Part]:
        """Everything collected so far, one part a (material, label), in a fixed order."""
        result = []
        for (material, label), bucket in sorted(self._buckets.items()):
            mesh = Mesh(
                vertices=np.concatenate(bucket.vertices),
                faces=np.concatenate(bucket.faces),
                uvs=np.concatenate(bucket.uvs),
                normals=np.concatenate(bucket.normals),
            )
            result.append(Part(material, label, mesh))
        return result


def box_faces(low: Sequence[float], high: Sequence[float]) -> dict[str, Array]:
    """The six faces of a box, counter-clockwise from outside, each starting at its lower left corner."""
    x0, y0, z0 = low
    x1, y1, z1 = high
    corners = {
        "x": [(x0, y1, z0), (x0, y0, z0), (x0, y0, z1), (x0, y1, z1)],
        "X": [(x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)],
        "y": [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
        "Y": [(x1, y1, z0), (x0, y1, z0), (x0, y1, z1), (x1, y1, z1)],
        "z": [(x0, y1, z0), (x1, y1, z0), (x1, y0, z0), (x0, y0, z0)],
        "Z": [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
    }
    return {face: np.asarray(points, np.float64) for face, points in corners.items()}


def planar_uvs(points: Array, tile_m: float) -> Array:
    """UVs (K, 2) of flat points (K, 3): the first at (0, 0), the first edge along u, metres over `tile_m`."""
    right = points[1] - points[0]
    right = right / np.linalg.norm(right)
    up = np.cross(_newell(points), right)
    offset = points - points[0]
    return np.stack([offset @ right, offset @ up], 1) / tile_m


def world_uvs(points: Array, tile_m: float) -> Array:
    """UVs (K, 2) of flat points (K, 3) that run on from face to face: u along the ground, v up (or along y)."""
    normal = _newell(points)
    if abs(normal[2]) > 0.9:
        return points[:, :2] / tile_m
    right = np.array([-normal[1], normal[0], 0.0])
    right /= np.linalg.norm(right)
    return np.stack([points @ right, points[:, 2]], 1) / tile_m


def place(
    parts: Iterable[Part], *, x_m: float = 0.0, y_m: float = 0.0, z_m: float = 0.0, yaw_rad: float = 0.0
) -> list[Part]:
    """Parts turned about z and then moved."""
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    placed = []
    for part in parts:
        mesh = part.mesh
        vertices = np.asarray(mesh.vertices, np.float64) @ turn.T + (x_m, y_m, z_m)
        normals = _normals(mesh) @ turn.T
        placed.append(
            Part(part.material, part.label, Mesh(vertices=vertices, faces=mesh.faces, uvs=mesh.uvs, normals=normals))
        )
    return placed


def merge(parts: Iterable[Part]) -> list[Part]:
    """Parts of one material and label made one: as few draw calls as there are pairs of them."""
    sink = Sink("static")
    sink.extend(parts)
    return sink.parts()


def triangle_count(parts: Iterable[Part]) -> int:
    """How many triangles the parts have together."""
    return sum(len(part.mesh.faces) for part in parts)


def _normals(mesh: Mesh) -> Array:
    if mesh.normals is None:
        raise ValueError("the kit's meshes have normals of their own; use authoring.mesh.smooth_normals first")
    return mesh.normals


def _swatch_uvs(swatch: str, count: int) -> Array:
    u0, v0, u1, v1 = swatch_rect(swatch)
    corners = np.array([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
    return corners if count == 4 else corners[np.arange(count) * 4 // count]


def _newell(points: Array) -> Array:
    """The unit normal of a polygon. Plain floats: arrays of four points cost NumPy six times as long."""
    x0, y0, z0 = points[0].tolist()
    edges = [(x - x0, y - y0, z - z0) for x, y, z in points.tolist()]
    nx = ny = nz = 0.0
    for (ax, ay, az), (bx, by, bz) in zip(edges, edges[1:] + edges[:1], strict=True):
        nx += ay * bz - az * by
        ny += az * bx - ax * bz
        nz += ax * by - ay * bx
    normal = np.array([nx, ny, nz])
    length = float(np.linalg.norm(normal))
    if length < 1e-12:
        raise ValueError(f"polygon has no area: {points.tolist()}")
    unit: Array = normal / length
    return unit
