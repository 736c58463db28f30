"""Round shapes in palette colours: cylinders, tubes along a path, domes, discs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Sink

Array = npt.NDArray[np.float64]


def cylinder(
    sink: Sink,
    swatch: str,
    foot: Sequence[float],
    radius_m: float,
    height_m: float,
    *,
    top_radius_m: float | None = None,
    segments: int = 12,
    cap: bool = True,
    label: str | None = None,
) -> None:
    """Adds an upright cylinder or cone frustum that stands on `foot`; `cap` closes its top."""
    x, y, z = foot
    tube(
        sink,
        swatch,
        [(x, y, z), (x, y, z + height_m)],
        [radius_m, radius_m if top_radius_m is None else top_radius_m],
        segments=segments,
        label=label,
    )
    if cap:
        disc(
            sink,
            swatch,
            (x, y, z + height_m),
            radius_m if top_radius_m is None else top_radius_m,
            segments=segments,
            label=label,
        )


def turned(
    sink: Sink, swatch: str, profile: Sequence[tuple[float, float]], *, segments: int = 12, label: str | None = None
) -> None:
    """Adds the surface of revolution of a profile of (radius, height) points about z; with the profile from below
    upwards, the outside is on its right.
    """
    angle = np.arange(segments) * 2 * np.pi / segments
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], 1)
    for (r0, z0), (r1, z1) in itertools.pairwise(profile):
        rings = np.concatenate([circle * r0 + (0, 0, z0), circle * r1 + (0, 0, z1)])
        normal = circle * (z1 - z0) + (0, 0, r0 - r1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        # Where the profile meets the axis a ring is one point and half of its faces are nothing.
        faces = ring_faces(2, segments)
        kept = faces if r0 and r1 else (faces[:segments] if r0 else faces[segments:])
        sink.swatch_mesh(swatch, rings, kept, np.concatenate([normal, normal]), label=label)


def disc(
    sink: Sink,
    swatch: str,
    centre: Sequence[float],
    radius_m: float,
    *,
    segments: int = 12,
    is_underside: bool = False,
    label: str | None = None,
) -> None:
    """A flat disc that faces up, or down as the underside of what stands on it."""
    angle = np.arange(segments) * 2 * np.pi / segments
    ring = np.stack([np.cos(angle) * radius_m, np.sin(angle) * radius_m, np.zeros(segments)], 1) + centre
    faces = [(0, i + 1, i) if is_underside else (0, i, i + 1) for i in range(1, segments - 1)]
    up = -1.0 if is_underside else 1.0
    sink.swatch_mesh(swatch, ring, faces, np.tile([0.0, 0.0, up], (segments, 1)), label=label)


def tube(
    sink: Sink,
    swatch: str,
    path: Sequence[Sequence[float]] | Array,
    radii_m: Sequence[float] | Array | float,
    *,
    segments: int = 10,
    caps: bool = False,
    label: str | None = None,
) -> None:
    """Adds a round tube along a path (K, 3), with smooth normals and without twist."""
    rings, normals = sweep(path, radii_m, segments=segments)
    sink.swatch_mesh(
        swatch, rings.reshape(-1, 3), ring_faces(len(rings), segments), normals.reshape(-1, 3), label=label
    )
    if caps:
        points = np.asarray(path, np.float64)
        fan = np.array([(0, i, i + 1) for i in range(1, segments - 1)])
        for ring, direction, faces in (
            (rings[0], points[0] - points[1], fan[:, ::-1]),
            (rings[-1], points[-1] - points[-2], fan),
        ):
            unit = direction / np.linalg.norm(direction)
            sink.swatch_mesh(swatch, ring, faces, np.tile(unit, (segments, 1)), label=label)


def sweep(
    path: Sequence[Sequence[float]] | Array, radii_m: Sequence[float] | Array | float, *, segments: int
) -> tuple[Array, Array]:
    """Returns rings of points (K, segments, 3) around a path (K, 3), and their outward unit normals."""
    points = np.asarray(path, np.float64)
    radii = np.broadcast_to(np.asarray(radii_m, np.float64), (len(points),))
    tangents = np.gradient(points, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    side = np.cross(tangents[0], (0.0, 0.0, 1.0))
    if np.linalg.norm(side) < 1e-3:
        side = np.array([1.0, 0.0, 0.0])
    angle = np.arange(segments) * 2 * np.pi / segments
    rings, normals = [], []
    for point, tangent, radius in zip(points, tangents, radii, strict=True):
        side = side - tangent * (side @ tangent)
        side = side / np.linalg.norm(side)
        other = np.cross(tangent, side)
        outward = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other
        normals.append(outward)
        rings.append(point + radius * outward)
    return np.stack(rings), np.stack(normals)


def ring_faces(rings: int, segments: int) -> npt.NDArray[np.int64]:
    """Returns the faces between consecutive rings of `segments` vertices."""
    ring, step = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    a = ring * segments + step
    b = ring * segments + (step + 1) % segments
    lower = np.stack([a, b, b + segments], -1)
    upper = np.stack([a, b + segments, a + segments], -1)
    faces: npt.NDArray[np.int64] = np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)]).astype(np.int64)
    return faces


def dome(
    sink: Sink,
    swatch: str,
    centre: Sequence[float],
    radius_m: float,
    height_m: float,
    *,
    segments: int = 12,
    rings: int = 4,
    label: str | None = None,
) -> None:
    """Adds the upper half of an ellipsoid (a cone with one ring) on `centre`."""
    angle = np.arange(segments) * 2 * np.pi / segments
    vertices: list[Array] = []
    for ring in range(rings):
        tilt = ring / rings * np.pi / 2
        level = np.stack([np.cos(angle), np.sin(angle), np.zeros(segments)], 1) * radius_m * np.cos(tilt)
        level[:, 2] = height_m * np.sin(tilt)
        vertices.append(level)
    points = np.concatenate([*vertices, [[0.0, 0.0, height_m]]])
    normals = points / (radius_m**2, radius_m**2, height_m**2)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tip = len(points) - 1
    last = (rings - 1) * segments
    fan = [(last + i, last + (i + 1) % segments, tip) for i in range(segments)]
    faces = np.concatenate([ring_faces(rings, segments), np.asarray(fan)]) if rings > 1 else np.asarray(fan)
    sink.swatch_mesh(swatch, points + centre, faces, normals, label=label)
