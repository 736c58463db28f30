"""The triangles of a model's geoms as OpenGL draws them: one vertex buffer, one index buffer and draw commands."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from gear.render import pinhole
from gear.render.pinhole import FAR_M
from gear.render.raster import primitives
from gear.render.raster.primitives import Triangles, height_field, primitive
from gear.values.array_shelf import ArrayShelf, code_digest
from gear.values.geometry import Array

VERTEX = np.dtype([("position_m", "<f4", 3), ("normal", "<i2", 4), ("texcoord", "<f4", 2)])
"""Memory layout of a vertex; components of normals are multiplied by 32767."""

DRAW_COMMAND = np.dtype([("count", "<i4"), ("first", "<i8"), ("base", "<i4")])
"""A draw command: number of indices, first index, and the number that is added to all indices."""

_MESHES = (int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_SDF))
_PLANE, _FIELD = int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)
_BITS = 21
_CELL_M = 48.0
_WHOLE = 512
"""Meshes with fewer triangles than this are not cut into pieces, because each piece takes a draw command."""

_Key = tuple[int, int, tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """The triangles of all geoms, cut into P pieces, so that pieces outside the view can be skipped.

    Attributes:
        vertices: (V,) of type `VERTEX`.
        indices: (I,) uint32, three for each triangle.
        commands: (P,) of type `DRAW_COMMAND`, one for each piece, in the order of geoms.
        geoms: (P,) id of the geom to which each piece belongs.
        centres_m: (P, 3) centres of bounding spheres of the pieces, in the frames of their geoms.
        radii_m: (P,) radii of these spheres.
    """

    vertices: npt.NDArray[np.void]
    indices: npt.NDArray[np.uint32]
    commands: npt.NDArray[np.void]
    geoms: npt.NDArray[np.intp]
    centres_m: Array
    radii_m: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """Triangles that several geoms share, and their pieces as in `Geometry`, with indices counted from the
    shape's first index.
    """

    vertices: npt.NDArray[np.void]
    indices: npt.NDArray[np.uint32]
    starts: npt.NDArray[np.int64]
    centres_m: Array
    radii_m: Array


def shelved_geometry(model: mujoco.MjModel, drawn: npt.NDArray[np.bool_], shelf: ArrayShelf) -> Geometry:
    """The triangles of the geoms that are drawn, as `geometry_of` collects them, from the shelf if they are there.

    Args:
        model: the compiled world.
        drawn: (ngeom,) bool: which geoms are drawn.
        shelf: shelf of this model.

    Raises:
        ValueError: a mesh has more than two million vertices.
    """

    def collected() -> tuple[npt.NDArray[Any], ...]:
        geometry = geometry_of(model, drawn)
        return tuple(getattr(geometry, field.name) for field in fields(Geometry))

    assert primitives.__file__ is not None and pinhole.__file__ is not None
    code = code_digest(__file__, primitives.__file__, pinhole.__file__)
    inputs = (code, mujoco.__version__.encode(), drawn.tobytes())
    return Geometry(*shelf.arrays("geometry", inputs, collected))


def geometry_of(model: mujoco.MjModel, drawn: npt.NDArray[np.bool_]) -> Geometry:
    """Collects the triangles of the geoms that are drawn; geoms with equal shapes share triangles.

    Args:
        model: the compiled world.
        drawn: (ngeom,) bool: which geoms are drawn.

    Raises:
        ValueError: a mesh has more than two million vertices.
    """
    shapes: dict[_Key, tuple[_Shape, int, int]] = {}
    commands, centres, radii = [np.zeros(0, DRAW_COMMAND)], [np.zeros((0, 3))], [np.zeros(0)]
    geoms: list[int] = []
    first = base = 0
    for geom in np.flatnonzero(drawn).tolist():
        key = _key(model, geom)
        if key not in shapes:
            made = _shape(_triangles(model, geom))
            shapes[key] = (made, first, base)
            first, base = first + len(made.indices), base + len(made.vertices)
        shape, shape_first, shape_base = shapes[key]
        pieces = np.zeros(len(shape.radii_m), DRAW_COMMAND)
        pieces["count"] = np.diff(shape.starts)
        pieces["first"] = shape_first + shape.starts[:-1]
        pieces["base"] = shape_base
        commands.append(pieces)
        geoms += [geom] * len(pieces)
        centres.append(shape.centres_m)
        radii.append(shape.radii_m)
    made_shapes = [shape for shape, _, _ in shapes.values()]
    return Geometry(
        vertices=np.concatenate([np.zeros(0, VERTEX), *(shape.vertices for shape in made_shapes)]),
        indices=np.concatenate([np.zeros(0, np.uint32), *(shape.indices for shape in made_shapes)]),
        commands=np.concatenate(commands),
        geoms=np.array(geoms, np.intp),
        centres_m=np.concatenate(centres),
        radii_m=np.concatenate(radii),
    )


def _key(model: mujoco.MjModel, geom: int) -> _Key:
    """A key that is equal for geoms with equal triangles and texture coordinates."""
    kind = int(model.geom_type[geom])
    if kind in _MESHES:
        return kind, int(model.geom_dataid[geom]), (), ()
    size = () if kind == _FIELD else tuple(model.geom_size[geom].tolist())
    return kind, int(model.geom_dataid[geom]), size, tuple(_texture_repeats(model, geom).tolist())


def _triangles(model: mujoco.MjModel, geom: int) -> Triangles:
    kind, index = int(model.geom_type[geom]), int(model.geom_dataid[geom])
    if kind in _MESHES:
        return _mesh(model, index)
    made = height_field(model, index) if kind == _FIELD else primitive(kind, model.geom_size[geom])
    return Triangles(made.positions_m, made.normals, made.texcoords * _texture_repeats(model, geom), made.corners)


def _texture_repeats(model: mujoco.MjModel, geom: int) -> Array:
    """(2,) how often a texture repeats over a primitive: `texrepeat`, which is per metre if `texuniform` is set."""
    material = int(model.geom_matid[geom])
    if material < 0:
        return np.ones(2)
    repeat: Array = model.mat_texrepeat[material].astype(np.float64)
    if model.mat_texuniform[material]:
        half_m = model.geom_size[geom, :2].astype(np.float64)
        # Planes of size 0 are infinite, and round primitives have no second size.
        instead = FAR_M if int(model.geom_type[geom]) == _PLANE else half_m[0]
        repeat = repeat * 2 * np.where(half_m > 0, half_m, instead)
    return repeat


def _mesh(model: mujoco.MjModel, index: int) -> Triangles:
    """The triangles of a mesh, with one vertex for each combination of position, normal and texture coordinate."""
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


def _shape(triangles: Triangles) -> _Shape:
    """Converts triangles to vertices and indices for the graphics device, cut into pieces by a grid of `_CELL_M`
    metres.
    """
    vertices = np.zeros(len(triangles.positions_m), VERTEX)
    vertices["position_m"] = triangles.positions_m
    vertices["normal"][:, :3] = np.round(32767 * triangles.normals)
    vertices["texcoord"] = triangles.texcoords
    corners = triangles.corners
    starts = np.array([0, len(corners)])
    if len(corners) > _WHOLE:
        cells = np.floor(triangles.positions_m[corners[:, 0]] / _CELL_M).astype(np.int64)
        cell = cells @ (1 << 2 * _BITS, 1 << _BITS, 1)
        order = np.argsort(cell, kind="stable")
        corners = corners[order]
        starts = np.concatenate([[0], np.flatnonzero(np.diff(cell[order])) + 1, [len(corners)]])
    starts = 3 * starts if len(corners) else np.zeros(1, np.int64)
    centres_m, radii_m = _spheres(triangles.positions_m[corners.reshape(-1)], starts)
    return _Shape(
        vertices=vertices,
        indices=corners.reshape(-1).astype(np.uint32),
        starts=starts,
        centres_m=centres_m,
        radii_m=radii_m,
    )


def _spheres(points_m: Array, starts: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Bounding spheres of consecutive runs of points: (P, 3) centres of their bounding boxes, (P,) distances of
    the farthest points.
    """
    if len(starts) < 2:
        return np.zeros((0, 3)), np.zeros(0)
    low, high = (ufunc.reduceat(points_m, starts[:-1]) for ufunc in (np.minimum, np.maximum))
    middles_m = (low + high).astype(np.float64) / 2
    away2 = ((points_m - np.repeat(middles_m, np.diff(starts), axis=0)) ** 2).sum(axis=1)
    return middles_m, np.asarray(np.sqrt(np.maximum.reduceat(away2, starts[:-1])))
