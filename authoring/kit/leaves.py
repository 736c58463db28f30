"""Foliage: lumpy masses with a leafy texture inside, and sprays of leaves, geometry too, that stand out of them."""

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


def scatter_leaves(
    sink: Sink,
    material: str,
    centres: Array,
    radii_m: Array,
    *,
    count: int,
    length_m: float,
    around: Array,
    rng: np.random.Generator,
    reach: tuple[float, float] = (0.7, 1.05),
) -> None:
    """Sprays of leaves on foliage masses: one pointed triangle each, seen from both sides, with leaves drawn on it.

    Args:
        sink: takes the faces.
        material: a foliage material.
        centres: (K, 3) of the masses.
        radii_m: (K, 3) half extents of the masses.
        count: sprays in all; larger masses get more.
        length_m: of a spray; the texture keeps its own scale, so that a long spray shows several leaves.
        around: (3,) or (K, 3), the middle that leaves point away from.
        rng: places and turns them.
        reach: where a spray's foot is between a mass's centre (0) and its surface (1).
    """
    share = radii_m[:, 0] ** 2
    mass = rng.choice(len(centres), size=count, p=share / share.sum())
    middle = np.broadcast_to(around, centres.shape)[mass]
    outside = _unit(centres[mass] - middle)
    direction = _unit(rng.normal(size=(count, 3)) + 1.1 * outside + (0, 0, 0.15))
    foot = centres[mass] + direction * radii_m[mass] * rng.uniform(*reach, (count, 1))
    outward = _unit(direction + 0.6 * outside)
    along = _unit(_unit(rng.normal(size=(count, 3))) + 0.75 * outward - (0, 0, 0.25))
    across = _unit(np.cross(along, _unit(outward + 0.7 * rng.normal(size=(count, 3)))))
    length = length_m * rng.uniform(0.6, 1.35, (count, 1))
    width = length * rng.uniform(0.26, 0.40, (count, 1))
    skew = along * length * rng.uniform(-0.1, 0.25, (count, 1))
    back = foot - along * length * 0.25
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
