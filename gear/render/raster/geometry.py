"""What a model's geoms are made of, as OpenGL draws it: one buffer of vertices, and where each geom's lie in it."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from gear.render.pinhole import FAR_M
from gear.render.raster.solids import Triangles, height_field, solid
from gear.values.geometry import Array

VERTEX = np.dtype([("position_m", "<f4", 3), ("normal", "<i2", 4), ("texcoord", "<f4", 2)])
"""As it lies in memory; normals count to 32767."""

COMMAND = np.dtype([(name, "<u4") for name in ("count", "instances", "first", "base", "geom")])
"""What OpenGL wants to know to draw one geom."""

_MESHES = (int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_SDF))
_PLANE, _FIELD = int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)
_BITS = 21
_Key = tuple[int, int, tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Triangles of all geoms.

    Attributes:
        vertices: (V,) `VERTEX`.
        indices: (I,) uint32, three for a triangle.
        commands: (ngeom,) `COMMAND`; a count of 0 where a geom has no triangles.
    """

    vertices: npt.NDArray[np.void]
    indices: npt.NDArray[np.uint32]
    commands: npt.NDArray[np.void]


def geometry_of(model: mujoco.MjModel, drawn: npt.NDArray[np.bool_]) -> Geometry:
    """Triangles of the geoms that are drawn; those that share a shape share its triangles.

    Raises:
        ValueError: a mesh has more than two million vertices.
    """
    commands = np.zeros(model.ngeom, COMMAND)
    commands["instances"], commands["geom"] = 1, np.arange(model.ngeom)
    vertices, indices, places = [], [], {}
    first = base = 0
    for geom in np.flatnonzero(drawn).tolist():
        key = _key(model, geom)
        if key not in places:
            made = _vertices(_triangles(model, geom))
            places[key] = (len(made[1]), first, base)
            vertices.append(made[0])
            indices.append(made[1])
            first, base = first + len(made[1]), base + len(made[0])
        commands["count"][geom], commands["first"][geom], commands["base"][geom] = places[key]
    return Geometry(
        vertices=np.concatenate([np.zeros(0, VERTEX), *vertices]),
        indices=np.concatenate([np.zeros(0, np.uint32), *indices]),
        commands=commands,
    )


def _key(model: mujoco.MjModel, geom: int) -> _Key:
    """The same for geoms of the same triangles and texture coordinates."""
    kind = int(model.geom_type[geom])
    if kind in _MESHES:
        return kind, int(model.geom_dataid[geom]), (), ()
    size = () if kind == _FIELD else tuple(model.geom_size[geom].tolist())
    return kind, int(model.geom_dataid[geom]), size, tuple(_repeats(model, geom).tolist())


def _triangles(model: mujoco.MjModel, geom: int) -> Triangles:
    kind, index = int(model.geom_type[geom]), int(model.geom_dataid[geom])
    if kind in _MESHES:
        return _mesh(model, index)
    made = height_field(model, index) if kind == _FIELD else solid(kind, model.geom_size[geom])
    return Triangles(made.positions_m, made.normals, made.texcoords * _repeats(model, geom), made.corners)


def _repeats(model: mujoco.MjModel, geom: int) -> Array:
    """(2,) how often a picture repeats over a primitive: `texrepeat`, per metre where the material says so."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return np.ones(2)
    repeat: Array = model.mat_texrepeat[material].astype(np.float64)
    if model.mat_texuniform[material]:
        half_m = model.geom_size[geom, :2].astype(np.float64)
        # Planes without a size have no end, and what is round has no second side.
        instead = FAR_M if int(model.geom_type[geom]) == _PLANE else half_m[0]
        repeat = repeat * 2 * np.where(half_m > 0, half_m, instead)
    return repeat


def _mesh(model: mujoco.MjModel, index: int) -> Triangles:
    """A mesh, with a vertex for each combination of place, normal and texture coordinate."""
    faces = slice(int(model.mesh_faceadr[index]), int(model.mesh_faceadr[index] + model.mesh_facenum[index]))
    if max(int(of[index]) for of in (model.mesh_vertnum, model.mesh_normalnum, model.mesh_texcoordnum)) >= 1 << _BITS:
        raise ValueError(f"mesh {model.mesh(index).name!r} is too large; cut it into several")
    place = model.mesh_face[faces].astype(np.int64)
    normal = model.mesh_facenormal[faces].astype(np.int64)
    has_texcoords = model.mesh_texcoordnum[index] > 0
    texcoord = model.mesh_facetexcoord[faces].astype(np.int64) if has_texcoords else np.zeros_like(place)
    both, corners = np.unique((place << 2 * _BITS) | (normal << _BITS) | texcoord, return_inverse=True)
    lowest = (1 << _BITS) - 1
    texcoords = np.zeros((len(both), 2))
    if has_texcoords:
        texcoords = model.mesh_texcoord[int(model.mesh_texcoordadr[index]) + (both & lowest)]
    return Triangles(
        positions_m=model.mesh_vert[int(model.mesh_vertadr[index]) + (both >> 2 * _BITS)],
        normals=model.mesh_normal[int(model.mesh_normaladr[index]) + ((both >> _BITS) & lowest)],
        texcoords=texcoords,
        corners=corners.reshape(-1, 3),
    )


def _vertices(triangles: Triangles) -> tuple[npt.NDArray[np.void], npt.NDArray[np.uint32]]:
    vertices = np.zeros(len(triangles.positions_m), VERTEX)
    vertices["position_m"] = triangles.positions_m
    vertices["normal"][:, :3] = np.round(32767 * triangles.normals)
    vertices["texcoord"] = triangles.texcoords
    return vertices, triangles.corners.reshape(-1).astype(np.uint32)
