"""Closed meshes through rings of points: bent tubes and strips."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from authoring.mesh import Mesh, grid, merge

__all__ = ["outward", "skinned", "tube"]


def tube(path: NDArray[np.float64] | Sequence[ArrayLike], radius: float | Sequence[float], sides: int = 8) -> Mesh:
    """A tube along (P, 3) points, with closed ends; one radius or one a point."""
    points = np.asarray(path, dtype=np.float64)
    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), (len(points),))
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    tangents = np.concatenate([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    across = np.cross(tangents[0], [0.0, 0.0, 1.0] if abs(tangents[0, 2]) < 0.9 else [1.0, 0.0, 0.0])
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rings = []
    for point, tangent, r in zip(points, tangents, radii, strict=True):
        across = across - tangent * (across @ tangent)
        across /= np.linalg.norm(across)
        up = np.cross(tangent, across)
        rings.append(point + r * (np.outer(np.cos(angle), across) + np.outer(np.sin(angle), up)))
    return skinned(np.stack(rings))


def skinned(rings: NDArray[np.float64]) -> Mesh:
    """A closed mesh through (R, C, 3) rings; the ends are fans, so they must be convex."""
    columns = rings.shape[1]
    fan = np.stack([np.zeros(columns - 2, dtype=np.int64), np.arange(1, columns - 1), np.arange(2, columns)], axis=1)
    ends = [Mesh.of(rings[0], fan[:, ::-1]), Mesh.of(rings[-1], fan)]
    wall = grid(rings, wrap=True)
    aim = rings[1].mean(axis=0) - rings[0].mean(axis=0)
    turn = np.cross(rings[0, 0] - rings[0].mean(axis=0), rings[0, 1] - rings[0].mean(axis=0)) @ aim
    walls, caps = (wall, ends) if turn < 0 else (wall.flipped(), ends)
    if turn < 0:
        caps = [cap.flipped() for cap in caps]
    return outward(merge([Mesh.of(part.vertices, part.faces) for part in (walls, *caps)]))


def outward(mesh: Mesh) -> Mesh:
    """The closed mesh with its faces turned outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    volume = float((np.cross(a, b) * c).sum())
    return mesh if volume >= 0.0 else mesh.flipped()
