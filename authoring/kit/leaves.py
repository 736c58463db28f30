"""Foliage: lumpy masses with a leafy texture inside, and twigs with leaves of geometry that stand out of them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import trimesh

from authoring.kit.parts import Sink
from authoring.materials.registry import MATERIALS

Array = npt.NDArray[np.float64]


def lump(
    sink: Sink,
    material: str,
    centre: Array,
    radii_m: Array,
    *,
    around: Array,
    detail: int,
    rng: np.random.Generator,
) -> None:
    """One mass of foliage: a dented ball that is shaded as a part of the crown around `around`.

    Args:
        sink: takes the faces.
        material: a foliage material.
        centre: (3,) of the mass.
        radii_m: (3,) half extents.
        around: (3,) the crown's middle: normals lean away from it, so that the crown is lit as one.
        detail: subdivisions of an icosahedron: 0 is 20 faces, 1 is 80.
        rng: dents it.
    """
    ball = trimesh.creation.icosphere(subdivisions=detail)
    unit = np.asarray(ball.vertices, np.float64)
    dent = rng.uniform(0.78, 1.12, (len(unit), 1))
    turn = float(rng.uniform(0, 2 * np.pi))
    spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    points = centre + (unit @ spin.T) * dent * radii_m
    faces = np.asarray(ball.faces, np.int64)
    corners = points[faces]
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


def scatter_sprigs(
    sink: Sink,
    material: str,
    centres: Array,
    radii_m: Array,
    *,
    count: int,
    leaf_m: float,
    around: Array,
    rng: np.random.Generator,
    simple: bool = False,
) -> None:
    """Twigs on the surfaces of foliage masses, three leaves each, every leaf seen from both sides.

    Args:
        sink: takes the faces.
        material: a foliage material.
        centres: (K, 3) of the masses.
        radii_m: (K,) of the masses.
        count: twigs in all; larger masses get more.
        leaf_m: length of a leaf.
        around: (3,) or (K, 3), the middle that leaves point away from.
        rng: places and turns them.
        simple: one leaf a twig, for the distance.
    """
    share = radii_m**2 / (radii_m**2).sum()
    mass = rng.choice(len(centres), size=count, p=share)
    middle = np.broadcast_to(around, centres.shape)[mass]
    direction = _unit(rng.normal(size=(count, 3)) + 0.9 * _unit(centres[mass] - middle) + (0, 0, 0.1))
    foot = centres[mass] + direction * (radii_m[mass] * rng.uniform(0.82, 1.04, count))[:, None]
    outward = _unit(direction + 0.5 * _unit(foot - middle))
    side = _unit(np.cross(outward, rng.normal(size=(count, 3))))
    other = np.cross(outward, side)
    leaves = 1 if simple else 3
    angle = np.arange(leaves) * 2 * np.pi / leaves + rng.uniform(-0.5, 0.5, (count, leaves))
    spread = np.cos(angle)[..., None] * side[:, None] + np.sin(angle)[..., None] * other[:, None]
    along = _unit(spread + outward[:, None] * rng.uniform(0.2, 0.8, (count, leaves, 1)) - (0, 0, 0.35))
    across = _unit(np.cross(along, outward[:, None]))
    length = leaf_m * rng.uniform(0.7, 1.25, (count, leaves, 1))
    width = length * 0.36
    fold = np.cross(across, along) * width * 0.5
    base = np.broadcast_to(foot[:, None], along.shape)
    # A leaf is two triangles folded along its midrib: base, right, tip and base, tip, left.
    right = base + along * length * 0.45 + across * width + fold
    left = base + along * length * 0.45 - across * width + fold
    tip = base + along * length
    corners = np.stack([base, right, tip, left], 2).reshape(-1, 3)
    quads = np.arange(len(corners)).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normals = _unit(outward[:, None] + 0.45 * np.cross(across, along)).reshape(-1, 3).repeat(4, 0)
    # Each leaf samples its own spot of the foliage texture, small enough to be nearly one shade.
    spot = rng.uniform(0, 1, (len(quads), 1, 2))
    shape = np.array([(0.0, 0.0), (0.05, 0.05), (0.0, 0.1), (-0.05, 0.05)])
    uvs = (spot + shape).reshape(-1, 2)
    sink.triangles(material, corners, faces, uvs=uvs, normals=normals)
    sink.triangles(material, corners, faces[:, ::-1], uvs=uvs, normals=normals)


def _unit(vectors: Array) -> Array:
    unit: Array = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    return unit
