"""Pieces: closed shapes, each with its colours, that belong to one geom, and their triangles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from authoring.mesh import Mesh
from authoring.people.decimate import decimate
from authoring.people.field import Array, Field
from authoring.people.polygonise import Faces, normals, polygonise, project

Tint = str | Callable[[Array], list[str]]
"""Name of a colour, or a function that maps (F, 3) positions to F names."""

MAX_FACES = 4150
"""Largest number of faces of all pieces together; covered faces, at least a tenth, are removed afterwards."""

_SCOUT_CELL_M = 0.09
_CREASE_COS = 0.6
_OCCLUSION_TAPS_M = (0.02, 0.05, 0.1)
_OCCLUSION_STRENGTH = 0.62


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Piece:
    """A closed shape of a person, such as a shoe.

    Attributes:
        group: name of its geom (`paint`, `cloth`, `skin`, `hair`, `shoes`, `extra`).
        field: signed distance of its surface, in the frame of the figure.
        faces: largest number of triangles.
        cell_m: size of the sampling grid, metres, from which triangles are removed afterwards.
        tint: its colours.
        dear: function that maps (N, 3) positions to factors on their number of triangles.
        borders: fields whose zeros are borders between colours; triangles are split there.
    """

    group: str
    field: Field
    faces: int
    cell_m: float
    tint: Tint
    dear: Callable[[Array], Array] | None = None
    borders: tuple[Field, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """A piece's triangles: vertices (V, 3), normals at the corners (F, 3, 3), faces (F, 3), light (V,) in 0..1."""

    piece: Piece
    vertices: Array
    faces: Faces
    corner_normals: Array
    light: Array


def mesh_pieces(pieces: Sequence[Piece]) -> list[Skin]:
    """Returns the triangles of all pieces without the covered ones, with the light that reaches each vertex."""
    share = min(1.0, MAX_FACES / sum(piece.faces for piece in pieces))
    raw = [_triangles(piece, int(share * piece.faces)) for piece in pieces]
    skins = []
    for number, (piece, (vertices, faces)) in enumerate(zip(pieces, raw, strict=True)):
        covered = np.zeros(len(vertices), dtype=bool)
        for other, cover in enumerate(pieces):
            if other != number:
                covered |= cover.field(vertices) < -0.007
        faces = faces[~covered[faces].all(axis=1)]
        corner_normals = _corner_normals(piece.field, vertices, faces)
        skins.append(
            Skin(piece, vertices, faces, corner_normals, _light(pieces, vertices, normals(piece.field, vertices)))
        )
    return skins


def _triangles(piece: Piece, count: int) -> tuple[Array, Faces]:
    low, high = _bounds(piece.field)
    vertices, faces = polygonise(piece.field, low, high, piece.cell_m)
    vertices = np.round(vertices, 4)  # what follows decides by comparing; hide the last bits of sines from it
    weight = None if piece.dear is None else piece.dear(vertices)
    vertices, faces = decimate(vertices, faces, count, weight)
    vertices = project(piece.field, vertices, limit=0.004, rounds=2)
    for border in piece.borders:
        vertices, faces = _split(vertices, faces, border(vertices))
    return vertices, faces


def _split(vertices: Array, faces: Faces, level: Array) -> tuple[Array, Faces]:
    """Splits triangles along the zeros of `level` (V,); the faces on both sides of an edge share the new vertex."""
    level = np.where(np.abs(level) < 5e-4, 5e-4, level)
    above = level > 0
    lone = np.where(above[faces].sum(axis=1) == 1, above[faces].T, ~above[faces].T).T
    mixed = above[faces].any(axis=1) & ~above[faces].all(axis=1)
    turn = np.argmax(lone[mixed], axis=1)
    a, b, c = (faces[mixed][np.arange(len(turn)), (turn + k) % 3] for k in range(3))
    edges = np.sort(np.concatenate([np.stack([a, b], 1), np.stack([a, c], 1)]), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    share = level[unique[:, 0]] / (level[unique[:, 0]] - level[unique[:, 1]])
    fresh = vertices[unique[:, 0]] + share[:, None] * (vertices[unique[:, 1]] - vertices[unique[:, 0]])
    ab, ac = np.split(inverse.reshape(-1) + len(vertices), 2)
    parts = [faces[~mixed], np.stack([a, ab, ac], 1), np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)]
    return np.concatenate([vertices, fresh]), np.concatenate(parts)


def _bounds(field: Field) -> tuple[Array, Array]:
    axes = [np.arange(-1.3, 1.3, _SCOUT_CELL_M)] * 2 + [np.arange(-1.2, 1.1, _SCOUT_CELL_M)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    near = points[field(points) < _SCOUT_CELL_M]
    return near.min(axis=0) - _SCOUT_CELL_M / 2, near.max(axis=0) + _SCOUT_CELL_M / 2


def _corner_normals(field: Field, vertices: Array, faces: Faces) -> Array:
    """Returns normals at the corners: those of the field, or that of the face at sharp edges."""
    smooth = normals(field, vertices)[faces]
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-12)
    agrees = (smooth * flat[:, None, :]).sum(axis=2) > _CREASE_COS
    return np.where(agrees[:, :, None], smooth, flat[:, None, :])


def _light(pieces: Sequence[Piece], vertices: Array, outward: Array) -> Array:
    """Returns the ambient light at each vertex: 1 without occlusion, less in armpits, in folds and below the chin."""
    loss = np.zeros(len(vertices))
    for tap in _OCCLUSION_TAPS_M:
        probes = vertices + tap * outward
        clear = np.minimum.reduce([piece.field(probes) for piece in pieces])
        loss += np.clip((0.7 * tap - clear) / (0.7 * tap), 0.0, 1.2) / len(_OCCLUSION_TAPS_M)
    return np.clip(1.0 - _OCCLUSION_STRENGTH * loss, 0.0, 1.0)


def combine(skins: Sequence[Skin], uv_of: Callable[[Skin], Array]) -> Mesh:
    """Joins several pieces into one mesh; `uv_of` gives (F, 3, 2) texture coordinates at the corners."""
    vertices = np.concatenate([skin.vertices[skin.faces].reshape(-1, 3) for skin in skins])
    corner_normals = np.concatenate([skin.corner_normals.reshape(-1, 3) for skin in skins])
    uvs = np.concatenate([uv_of(skin).reshape(-1, 2) for skin in skins])
    return Mesh.of(vertices, np.arange(len(vertices)).reshape(-1, 3), uvs, corner_normals)
