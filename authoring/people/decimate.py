"""Reduces the number of triangles by quadric edge collapse (Garland and Heckbert), many independent edges per round."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import sparse

from authoring.people.field import Array
from authoring.people.polygonise import Faces

_STEADY = 1e-3
_MIN_TURN_COS = 0.2


def decimate(vertices: Array, faces: Faces, target: int, weight: Array | None = None) -> tuple[Array, Faces]:
    """Collapses edges until at most `target` faces are left, or until every further collapse would fold the surface.

    Args:
        vertices: (V, 3) vertices of a closed surface.
        faces: (F, 3) indices of the vertices of each face.
        target: largest number of faces of the result.
        weight: (V,) factors on the error at each vertex; 1 if not given.
    """
    weights = np.ones(len(vertices)) if weight is None else weight.copy()
    quadrics = _quadrics(vertices, faces, weights)
    forbidden: set[tuple[int, int]] = set()
    while len(faces) > target:
        ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges = np.stack(np.divmod(np.unique(ends[:, 0] * len(vertices) + ends[:, 1]), len(vertices)), axis=1)
        cost, place = _best_places(vertices, quadrics, edges)
        if forbidden:
            bad = np.fromiter(((a, b) in forbidden for a, b in edges.tolist()), dtype=bool, count=len(edges))
            cost = np.where(bad, np.inf, cost)
        chosen = _independent(edges, cost, len(vertices))
        chosen = chosen[np.argsort(cost[chosen], kind="stable")][: max(1, (len(faces) - target + 1) // 2)]
        fine = _keeps_the_surface(vertices, faces, edges, chosen, place)
        forbidden |= {(int(a), int(b)) for a, b in edges[chosen[~fine]]}
        chosen = chosen[fine]
        if len(chosen) == 0:
            if not np.isfinite(cost).any():
                break
            continue
        keep, gone = edges[chosen].T
        vertices = vertices.copy()
        vertices[keep] = place[chosen]
        quadrics[keep] += quadrics[gone]
        touched = set(np.concatenate([keep, gone]).tolist())
        forbidden = {pair for pair in forbidden if not touched & set(pair)}
        remap = np.arange(len(vertices))
        remap[gone] = keep
        faces = remap[faces]
        faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    used = np.unique(faces)
    index = np.zeros(len(vertices), dtype=np.int64)
    index[used] = np.arange(len(used))
    return vertices[used], index[faces]


def _quadrics(vertices: Array, faces: Faces, weights: Array) -> Array:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    double_area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.maximum(double_area, 1e-15)
    plane = np.concatenate([normal, -(normal * a).sum(axis=1, keepdims=True)], axis=1)
    outer = plane[:, :, None] * plane[:, None, :] * double_area[:, :, None]
    quadrics = np.zeros((len(vertices), 4, 4))
    for k in range(3):
        np.add.at(quadrics, faces[:, k], outer)
    return quadrics * weights[:, None, None]


def _best_places(vertices: Array, quadrics: Array, edges: Faces) -> tuple[Array, Array]:
    both = quadrics[edges[:, 0]] + quadrics[edges[:, 1]]
    middle = vertices[edges].mean(axis=1)
    matrix, right = both[:, :3, :3].copy(), -both[:, :3, 3]
    trace = np.trace(matrix, axis1=1, axis2=2)
    steady = _STEADY * trace + 1e-15
    matrix += steady[:, None, None] * np.eye(3)
    place = np.linalg.solve(matrix, (right + steady[:, None] * middle)[:, :, None])[:, :, 0]
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    far = np.linalg.norm(place - middle, axis=1) > length
    place[far] = middle[far]
    homogeneous = np.concatenate([place, np.ones((len(place), 1))], axis=1)
    cost = np.einsum("ni,nij,nj->n", homogeneous, both, homogeneous)
    # Where everything is flat, short edges go first: even triangles, and an order that does not hang on rounding.
    return cost + 1e-4 * trace * length**2, place


def _independent(edges: Faces, cost: Array, count: int) -> Faces:
    """Returns edges with the smallest cost within two rings of neighbours, so that no face is changed twice."""
    rank = np.empty(len(edges))
    rank[np.argsort(cost, kind="stable")] = np.arange(len(edges))
    nearest = np.full(count, np.inf)
    for _ in range(2):
        best = np.minimum(rank, nearest[edges].min(axis=1))
        spread = nearest.copy()
        np.minimum.at(spread, edges[:, 0], best)
        np.minimum.at(spread, edges[:, 1], best)
        nearest = spread
    return np.flatnonzero((rank == nearest[edges].min(axis=1)) & np.isfinite(cost))


def _keeps_the_surface(
    vertices: Array, faces: Faces, edges: Faces, chosen: Faces, place: Array
) -> npt.NDArray[np.bool_]:
    """Returns whether each chosen collapse keeps the surface closed and turns no face over."""
    count = len(vertices)
    ends = np.concatenate([edges, edges[:, ::-1]])
    near = sparse.csr_matrix((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    shared = np.asarray(near[edges[chosen, 0]].multiply(near[edges[chosen, 1]]).sum(axis=1)).ravel()
    owner = np.full(count, -1)
    owner[edges[chosen, 0]] = np.arange(len(chosen))
    owner[edges[chosen, 1]] = np.arange(len(chosen))
    owned = owner[faces]
    belongs = owned.max(axis=1)
    dies = (owned >= 0).sum(axis=1) >= 2
    affected = (belongs >= 0) & ~dies
    corners = vertices[faces[affected]]
    moved = np.where((owned[affected] >= 0)[:, :, None], place[chosen][belongs[affected]][:, None, :], corners)
    old, new = (np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (corners, moved))
    lengths = np.linalg.norm(old, axis=1) * np.linalg.norm(new, axis=1)
    turned = (old * new).sum(axis=1) < _MIN_TURN_COS * lengths
    fine: npt.NDArray[np.bool_] = shared == 2
    np.logical_and.at(fine, belongs[affected], ~turned)
    return fine
