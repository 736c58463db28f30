"""Converts a distance field to triangles by surface nets, and moves every vertex onto the surface."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from authoring.people.field import Array, Field, gradient

Faces = npt.NDArray[np.int64]
_CORNERS = np.array(list(itertools.product((0, 1), repeat=3)))
_EDGES = [(a, b) for a, b in itertools.combinations(range(8), 2) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]

_STRIDE = 4
_NEAR_CELLS = 11.0


def polygonise(field: Field, low: Array, high: Array, cell_m: float) -> tuple[Array, Faces]:
    """Returns the triangles of the zero level inside the box `low`..`high`.

    Returns:
        (V, 3) vertices in metres and (F, 3) faces, counter-clockwise seen from outside.
    """
    axes = [np.arange(lo - 2 * cell_m, hi + 3 * cell_m, cell_m) for lo, hi in zip(low, high, strict=True)]
    vertices, faces = _surface_nets(_sample(field, axes, cell_m))
    origin = np.array([axis[0] for axis in axes])
    return project(field, origin + vertices * cell_m, limit=cell_m / 2, rounds=2), faces


def _sample(field: Field, axes: list[Array], cell_m: float) -> Array:
    """Returns the field on a grid: exact near the surface; elsewhere only the sign is correct."""
    coarse = [axis[::_STRIDE] for axis in axes]
    points = np.stack(np.meshgrid(*coarse, indexing="ij"), axis=-1)
    far = field(points.reshape(-1, 3)).reshape(points.shape[:3])
    blocks = [np.arange(len(axis)) // _STRIDE for axis in axes]
    values = far[np.ix_(*blocks)]
    near = np.abs(values) < _NEAR_CELLS * cell_m
    places = np.argwhere(near)
    values[near] = field(np.stack([axis[places[:, k]] for k, axis in enumerate(axes)], axis=1))
    return values


def project(field: Field, points: Array, *, limit: float, rounds: int = 3) -> Array:
    """Moves (V, 3) points along the gradient onto the zero level, at most `limit` metres per round."""
    for _ in range(rounds):
        slope = gradient(field, points)
        square = np.maximum((slope**2).sum(axis=1), 0.05)
        step = -(field(points) / square)[:, None] * slope
        length = np.linalg.norm(step, axis=1, keepdims=True)
        points = points + step * np.minimum(1.0, limit / np.maximum(length, 1e-12))
    return points


def normals(field: Field, points: Array) -> Array:
    """Returns the (V, 3) outward unit normals of a field at (V, 3) points."""
    slope = gradient(field, points, step=2e-3)
    return np.asarray(slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9))


def _surface_nets(values: Array) -> tuple[Array, Faces]:
    shape = np.array(values.shape) - 1
    corner = [
        values[tuple(slice(offset, offset + size) for offset, size in zip(corner, shape, strict=True))].ravel()
        for corner in _CORNERS
    ]
    inside = sum((value < 0).astype(np.int64) for value in corner)
    active = np.flatnonzero((inside > 0) & (inside < 8))
    corner = [value[active] for value in corner]
    total, count = np.zeros((len(active), 3)), np.zeros(len(active))
    for a, b in _EDGES:
        crosses = (corner[a] < 0) != (corner[b] < 0)
        span = np.where(crosses, corner[a] - corner[b], 1.0)
        share = np.where(crosses, corner[a] / span, 0.0)
        total += crosses[:, None] * (_CORNERS[a] + share[:, None] * (_CORNERS[b] - _CORNERS[a]))
        count += crosses
    cells = np.stack(np.unravel_index(active, tuple(shape)), axis=1)
    index = np.full(int(np.prod(shape)), -1, dtype=np.int64)
    index[active] = np.arange(len(active))
    return cells + total / count[:, None], _net_faces(values, index.reshape(tuple(shape)))


def _net_faces(values: Array, index: Faces) -> Faces:
    negative = values < 0
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        low = np.take(negative, range(values.shape[axis] - 1), axis=axis)
        high = np.take(negative, range(1, values.shape[axis]), axis=axis)
        places = np.argwhere(low != high)
        places = places[(places[:, u] > 0) & (places[:, v] > 0)]
        outward = low[tuple(places.T)]
        step_u, step_v = np.eye(3, dtype=np.int64)[u], np.eye(3, dtype=np.int64)[v]
        ring = [places - step_u - step_v, places - step_v, places, places - step_u]
        quad = np.stack([index[tuple(place.T)] for place in ring], axis=1)
        quads.append(np.where(outward[:, None], quad, quad[:, ::-1]))
    quad = np.concatenate(quads)
    return np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
