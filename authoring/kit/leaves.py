"""Foliage: dented masses with a texture of leaves, and sprays of leaves around them, which are geometry, too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import trimesh

from authoring.kit.parts import Sink
from authoring.materials.registry import MATERIALS

Array = npt.NDArray[np.float64]

TRIALS = 4
HIDDEN = 0.85
"""Share of the radius of a mass; points that lie deeper than this in another mass count as inside it."""


def lump(
    sink: Sink,
    material: str,
    centre: Array,
    radii_m: Array,
    *,
    around: Array,
    detail: int,
    rng: np.random.Generator,
) -> Array:
    """Adds one mass of foliage: a dented ellipsoid that is shaded as a part of the crown around `around`.

    Args:
        sink: collects the faces.
        material: a foliage material.
        centre: (3,) centre of the mass, metres.
        radii_m: (3,) half extents, metres.
        around: (3,) middle of the crown; normals point away from it, so that the crown is shaded as a whole.
        detail: subdivisions of an icosahedron: 0 gives 20 faces, 1 gives 80.
        rng: random generator of the dents.

    Returns:
        (F, 3, 3) corners of the faces.
    """
    ball = trimesh.creation.icosphere(subdivisions=detail)
    unit = np.asarray(ball.vertices, np.float64)
    dent = rng.uniform(0.78, 1.12, (len(unit), 1))
    turn = float(rng.uniform(0, 2 * np.pi))
    spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    points = centre + (unit @ spin.T) * dent * radii_m
    faces = np.asarray(ball.faces, np.int64)
    corners: Array = points[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(flat).argmax(1)
    tile_m = MATERIALS[material].tile_m
    planes = np.array([(1, 2), (0, 2), (0, 1)])[axis]
    uvs = np.take_along_axis(corners, planes[:, None, :].repeat(3, 1), axis=2) / tile_m
    normals = _unit(_unit(corners - centre) + 0.6 * _unit(corners - around))
    sink.triangles(
        material,
        corners.reshape(-1, 3),
        np.arange(len(faces) * 3).reshape(-1, 3),
        uvs=uvs.reshape(-1, 2),
        normals=normals.reshape(-1, 3),
    )
    return corners


def on_masses(
    masses: Sequence[Array], centres: Array, radii_m: Array, *, count: int, around: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draws the places of sprays on overlapping masses of foliage, evenly over the surface that is visible from
    outside.

    Args:
        masses: (F, 3, 3) faces of each mass, as `lump` returns them.
        centres: (K, 3) centres of the masses, metres.
        radii_m: (K, 3) half extents of the masses, metres.
        count: number of points.
        around: (3,) middle of the crown.
        rng: random generator of the places.

    Returns:
        (count, 3) points on the faces, and (count, 3) unit vectors away from mass and crown.
    """
    faces = np.concatenate(masses)
    owner = np.repeat(np.arange(len(masses)), [len(mass) for mass in masses])
    area = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1)
    # Of these many times more points than are wanted, enough lie in no other mass.
    face = rng.choice(len(faces), size=count * TRIALS, p=area / area.sum())
    share = rng.dirichlet((1.0, 1.0, 1.0), count * TRIALS)
    points = np.einsum("nc,ncx->nx", share, faces[face])
    depth = np.linalg.norm((points[:, None] - centres) / radii_m, axis=-1)
    depth[np.arange(len(points)), owner[face]] = np.inf
    seen = np.flatnonzero(depth.min(1) > HIDDEN)
    kept = np.concatenate([seen, np.setdiff1d(np.arange(len(points)), seen)])[:count]
    points, mass = points[kept], owner[face][kept]
    outward = _unit(_unit(points - centres[mass]) + 0.6 * _unit(points - around))
    return points, outward


def scatter_leaves(
    sink: Sink,
    material: str,
    feet: Array,
    outward: Array,
    *,
    length_m: float,
    rng: np.random.Generator,
    lift: float = 1.0,
    breadth: float = 1.0,
) -> None:
    """Adds sprays of leaves: each is one pointed triangle, visible from both sides, with a texture of leaves.

    Args:
        sink: collects the faces.
        material: a foliage material.
        feet: (N, 3) places where the sprays begin, metres.
        outward: (N, 3) unit vectors out of the foliage.
        length_m: length of a spray in metres; the texture keeps its own scale, so a long spray shows several leaves.
        rng: random generator of the directions.
        lift: 0 for sprays that lie flat on their mass, 1 for sprays that point straight out of it.
        breadth: factor on the width of a spray; 1 for a slender one.
    """
    count = len(feet)
    along = _unit(_unit(rng.normal(size=(count, 3))) + 0.75 * outward - (0, 0, 0.25))
    along = _unit(along - (1 - lift) * (along * outward).sum(-1, keepdims=True) * outward)
    across = _unit(np.cross(along, _unit(outward + 0.7 * rng.normal(size=(count, 3)))))
    length = length_m * rng.uniform(0.6, 1.35, (count, 1))
    width = length * rng.uniform(0.26, 0.40, (count, 1)) * breadth
    skew = along * length * rng.uniform(-0.1, 0.25, (count, 1))
    back = feet - along * length * 0.25
    corners = np.stack([back - across * width, back + across * width + skew, back + along * length], 1).reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    face_normal = np.cross(across, along)
    face_normal *= np.sign((face_normal * outward).sum(-1, keepdims=True))
    normals = _unit(outward + 0.55 * face_normal + (0, 0, 0.3)).repeat(3, 0)
    tile_m = MATERIALS[material].tile_m
    shape = np.stack([-width, width, np.zeros_like(width)], 1)
    rise = np.stack([np.zeros_like(length), length * 0.1, length], 1)
    uvs = rng.uniform(0, 1, (count, 1, 2)) + np.concatenate([shape, rise], -1) / tile_m
    sink.triangles(material, corners, faces, uvs=uvs.reshape(-1, 2), normals=normals)
    sink.triangles(material, corners, faces[:, ::-1], uvs=uvs.reshape(-1, 2), normals=normals)


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return unit
