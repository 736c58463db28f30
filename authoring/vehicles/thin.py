"""Removes vertices of a sheet that its shape does not need, so that flat parts have fewer triangles."""

from __future__ import annotations

import numpy as np

from authoring.mesh import Floats, Ints
from authoring.vehicles.sheet import Sheet

__all__ = ["thin"]

_ROUNDS = 12
_LEAST_HEIGHT = 0.06
"""Smallest height of a new triangle as a share of its longest side, unless it replaces thinner triangles."""


class _Trial:
    """Computes how well faces would lie on a patch, and keeps the results."""

    def __init__(self, sheet: Sheet, miss_m: float, least_cos: float) -> None:
        """Takes the sheet as it is; its vertices keep their numbers meanwhile."""
        self._patch, self._params, self._points = sheet.patch, sheet.params, sheet.points
        self._normals = sheet.patch.normals(sheet.params)
        self._miss_m, self._least_cos = miss_m, least_cos
        self._known: dict[tuple[int, ...], float] = {}

    def misses(self, faces: list[tuple[int, ...]]) -> Floats:
        """(N,) how far faces miss the patch, metres; infinite where one is not to be."""
        new = [face for face in dict.fromkeys(faces) if face not in self._known]
        if new:
            self._known.update(zip(new, self._fit(np.array(new)).tolist(), strict=True))
        return np.array([self._known[face] for face in faces])

    def _fit(self, faces: Ints) -> Floats:
        corners, params = self._points[faces], self._params[faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice = np.linalg.norm(cross, axis=1)
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        normal = self._patch.normals(params.mean(axis=1))
        miss = np.zeros(len(faces))
        for weights in ((1 / 3, 1 / 3, 1 / 3), (0.5, 0.5, 0), (0, 0.5, 0.5), (0.5, 0, 0.5)):
            share = np.array(weights)[:, None]
            off = self._patch.evaluate((share * params).sum(axis=1)) - (share * corners).sum(axis=1)
            miss = np.maximum(miss, np.abs((off * normal).sum(axis=1)))
        mean = self._normals[faces].mean(axis=1)
        agree = (mean * normal).sum(axis=1) / np.linalg.norm(mean, axis=1)
        upright = (cross * normal).sum(axis=1) > 0.9 * twice
        bad = (miss > self._miss_m) | (agree < self._least_cos) | ~upright | (twice < _LEAST_HEIGHT * longest**2)
        # Rounded, so that which vertices go first hangs on no processor's last digit.
        return np.asarray(np.where(bad, np.inf, np.round(miss, 6)))


def thin(sheet: Sheet, *, miss_m: float = 0.002, bend_deg: float = 3.5, border_m: float = 0.0012) -> None:
    """Moves vertices into neighbours, which takes two faces away each, as long as nothing is seen of it.

    The sheet's own rim stays, for its neighbour meets it there vertex by vertex.

    Args:
        sheet: to change in place.
        miss_m: how far the middle of a new face may lie from the patch.
        bend_deg: how far its smoothed normal may be from the patch's there.
        border_m: how far a vertex between two materials may lie from the line through its neighbours along the border.
    """
    trial = _Trial(sheet, miss_m, float(np.cos(np.radians(bend_deg))))
    for _ in range(_ROUNDS):
        if not _round(sheet, trial, border_m):
            break
    used, inverse = np.unique(sheet.faces, return_inverse=True)
    sheet.params, sheet.faces = sheet.params[used], inverse.reshape(-1, 3)


def _round(sheet: Sheet, trial: _Trial, border_m: float) -> bool:
    """Takes out as many vertices as can go side by side; returns whether there were any."""
    targets = _targets(sheet, border_m)
    around: list[list[int]] = [[] for _ in sheet.params]
    for k, face in enumerate(sheet.faces.tolist()):
        for corner in face:
            around[corner].append(k)
    moves: list[tuple[int, int]] = []
    new_faces: list[tuple[int, ...]] = []
    owners: list[int] = []
    for vertex, choices in targets.items():
        ring = [sheet.faces[k].tolist() for k in around[vertex]]
        for target in choices:
            if not _keeps_the_mesh(ring, around, sheet, vertex, target):
                continue
            new = [tuple(target if c == vertex else c for c in face) for face in ring if target not in face]
            owners += [len(moves)] * len(new)
            new_faces += new
            moves.append((vertex, target))
    if not moves:
        return False
    good = np.ones(len(moves), dtype=bool)
    cost = np.zeros(len(moves))
    worst = trial.misses(new_faces)
    np.logical_and.at(good, owners, np.isfinite(worst))
    np.maximum.at(cost, owners, worst)
    locked = np.zeros(len(sheet.params), dtype=bool)
    gone = np.zeros(len(sheet.faces), dtype=bool)
    faces = sheet.faces.copy()
    for k in np.argsort(cost, kind="stable").tolist():
        vertex, target = moves[k]
        near = np.unique(sheet.faces[around[vertex]])
        if not good[k] or locked[near].any():
            continue
        locked[near] = True
        for f in around[vertex]:
            gone[f] = target in sheet.faces[f]
            faces[f][faces[f] == vertex] = target
    sheet.faces = faces[~gone]
    sheet.material = [name for name, g in zip(sheet.material, gone.tolist(), strict=True) if not g]
    return bool(gone.any())


def _targets(sheet: Sheet, border_m: float) -> dict[int, list[int]]:
    """Where each vertex may go: to any neighbour within a material, along a straight border, nowhere from the rim."""
    half = np.concatenate([sheet.faces[:, [0, 1]], sheet.faces[:, [1, 2]], sheet.faces[:, [2, 0]]])
    name = np.tile(np.unique(np.array(sheet.material), return_inverse=True)[1], 3)
    edges, inverse, count = np.unique(np.sort(half, axis=1), axis=0, return_inverse=True, return_counts=True)
    low, high = np.full(len(edges), 1 << 30), np.full(len(edges), -1)
    np.minimum.at(low, inverse, name)
    np.maximum.at(high, inverse, name)
    neighbours: dict[int, list[int]] = {}
    borders: dict[int, list[int]] = {}
    for (a, b), is_border in zip(edges.tolist(), (low != high).tolist(), strict=True):
        for one, other in ((a, b), (b, a)):
            neighbours.setdefault(one, []).append(other)
            if is_border:
                borders.setdefault(one, []).append(other)
    for vertex in np.unique(edges[count == 1]).tolist():
        neighbours.pop(vertex, None)
    points = sheet.points
    for vertex, along in borders.items():
        if vertex not in neighbours:
            continue
        neighbours[vertex] = []
        if len(along) == 2:
            a, b = points[along[0]], points[along[1]]
            span = (b - a) / max(float(np.linalg.norm(b - a)), 1e-12)
            off = points[vertex] - a
            if np.linalg.norm(off - (off @ span) * span) < border_m and 0 < off @ span < np.linalg.norm(b - a):
                neighbours[vertex] = along
    return {vertex: choices for vertex, choices in neighbours.items() if choices}


def _keeps_the_mesh(ring: list[list[int]], around: list[list[int]], sheet: Sheet, vertex: int, target: int) -> bool:
    """Whether the two have no common neighbours but the corners of the two faces that go."""
    mine = {c for face in ring for c in face} - {vertex}
    theirs = {int(c) for k in around[target] for c in sheet.faces[k]} - {target}
    return len(mine & theirs) == 2 and sum(target in face for face in ring) == 2
