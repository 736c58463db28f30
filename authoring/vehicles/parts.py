"""The meshes of a vehicle under construction, by material."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from authoring.mesh import Mesh, merge

__all__ = ["Parts"]


@dataclass
class Parts:
    """Meshes by material, in the vehicle's frame."""

    meshes: dict[str, list[Mesh]] = field(default_factory=dict)

    def add(self, name: str, mesh: Mesh, both_sides: bool = False) -> None:
        """Adds a mesh; `both_sides` adds its mirror image across y = 0 as well."""
        if len(mesh.faces) == 0:
            return
        self.meshes.setdefault(name, []).append(mesh)
        if both_sides:
            self.meshes[name].append(mesh.scaled(1, -1, 1))

    def merged(self) -> dict[str, Mesh]:
        """One mesh a material; paint runs smoothly from patch to patch."""
        return {
            name: _blended(merge(pieces)) if name == "paint" else merge(pieces) for name, pieces in self.meshes.items()
        }


def _blended(mesh: Mesh, crease_deg: float = 55.0) -> Mesh:
    """Averages the normals of vertices at one place that differ by less than the crease angle."""
    assert mesh.normals is not None
    _, place = np.unique(np.floor(mesh.vertices * 5e3 + 0.5).astype(np.int64), axis=0, return_inverse=True)
    place = place.reshape(-1)
    order = np.argsort(place, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(place[order]) != 0])
    normals = mesh.normals.copy()
    for members in np.split(order, starts[1:]):
        if len(members) > 1:
            around = mesh.normals[members]
            close = around @ around.T >= np.cos(np.radians(crease_deg))
            mean = close.astype(np.float64) @ around
            normals[members] = mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
    return Mesh(mesh.vertices, mesh.faces, mesh.uvs, normals)
