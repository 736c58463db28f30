"""Smooth surface patches that bodies are made of: a B-spline belt round the plan, and a cap over its upper rim.

A patch maps parameters (u, v) in [0, 1]² to points of the left half (y >= 0) of a vehicle, in metres in the vehicle's
frame (x forward, y left, z up). u runs from the front's middle round to the rear's middle, v upwards (belt) or from the
rim to the centre line (cap).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline

from authoring.mesh import Floats

__all__ = ["Deform", "Patch", "arch_flare", "belt", "cap", "curve", "through"]

Deform = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Patch:
    """A parametric surface.

    Attributes:
        evaluate: maps (N, 2) parameters to (N, 3) points.
        outward: +1 if du × dv points outside, -1 if inside.
    """

    evaluate: Callable[[Floats], Floats]
    outward: float

    def normals(self, params: Floats) -> Floats:
        """(N, 3) outward unit normals at (N, 2) parameters."""
        step = 2e-4
        low, high = np.clip(params - step, 0, 1), np.clip(params + step, 0, 1)
        du = self.evaluate(np.column_stack([high[:, 0], params[:, 1]]))
        du -= self.evaluate(np.column_stack([low[:, 0], params[:, 1]]))
        dv = self.evaluate(np.column_stack([params[:, 0], high[:, 1]]))
        dv -= self.evaluate(np.column_stack([params[:, 0], low[:, 1]]))
        n = self.outward * np.cross(du, dv)
        # On the centre line the surface meets its mirror image without a ridge.
        points = self.evaluate(params)
        n[np.abs(points[:, 1]) < 1e-6, 1] = 0.0
        out: Floats = n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-12)
        return out


def _basis(count: int, t: Floats) -> Floats:
    degree = min(3, count - 1)
    knots = np.concatenate([np.zeros(degree), np.linspace(0, 1, count - degree + 1), np.ones(degree)])
    inside = np.clip(t, 0.0, 1.0 - 1e-12)
    return np.asarray(BSpline.design_matrix(inside, knots, degree).toarray(), dtype=np.float64)


def curve(control: ArrayLike) -> Callable[[Floats], Floats]:
    """The clamped cubic B-spline of a (C, D) control polygon, as a function of t in [0, 1]."""
    points = np.asarray(control, dtype=np.float64)
    return lambda t: _basis(len(points), np.atleast_1d(np.asarray(t, np.float64))) @ points


def through(points: ArrayLike) -> Callable[[Floats], Floats]:
    """A smooth function of one variable near (P, 2) points: the B-spline of their polygon, tabulated over its x."""
    polygon = np.asarray(points, dtype=np.float64)
    samples = curve(polygon[np.argsort(polygon[:, 0], kind="stable")])(np.linspace(0, 1, 401))
    return lambda x: np.interp(x, samples[:, 0], samples[:, 1])


def arch_flare(wheels_x: ArrayLike, hub_z: float, radius: float, height: float = 0.018, reach: float = 0.09) -> Deform:
    """Pushes a body's side out a little about its wheel arches, fading within `reach` metres."""

    def deform(p: Floats) -> Floats:
        out = p.copy()
        for x in np.atleast_1d(wheels_x):
            distance = np.hypot(p[:, 0] - x, p[:, 2] - hub_z) - radius
            near = np.exp(-((np.maximum(distance, 0) / reach) ** 2))
            side = np.clip((p[:, 1] - 0.5) / 0.2, 0, 1)
            out[:, 1] += height * near * side
        return out

    return deform


def belt(net: ArrayLike, deform: Deform | None = None) -> Patch:
    """The cubic B-spline surface of an (around, levels, 3) control net, then moved by `deform`."""
    control = np.asarray(net, dtype=np.float64)

    def evaluate(params: Floats) -> Floats:
        around, up = _basis(control.shape[0], params[:, 0]), _basis(control.shape[1], params[:, 1])
        points: Floats = np.einsum("ni,nj,ijk->nk", around, up, control, optimize=True)
        return points if deform is None else deform(points)

    return Patch(evaluate, 1.0)


def cap(side: Patch, corner_front: float, corner_rear: float, centre_z: Callable[[Floats], Floats]) -> Patch:
    """Closes a belt's upper rim over to the centre line y = 0.

    Args:
        side: the belt; its rim is v = 1.
        corner_front: the rim's parameter where the front edge ends and the side begins.
        corner_rear: likewise for side and rear edge.
        centre_z: height of the centre line above its straight mean line between front and rear, as a function of x;
            it is forced to meet the rim at both ends.
    """

    def rim(u: Floats) -> Floats:
        return side.evaluate(np.column_stack([u, np.ones_like(u)]))

    front, rear = rim(np.zeros(1))[0], rim(np.ones(1))[0]

    def centre(a: Floats) -> Floats:
        line = front + a[:, None] * (rear - front)
        shift = centre_z(line[:, 0])
        ends = centre_z(np.array([front[0], rear[0]])) - np.array([front[2], rear[2]])
        line[:, 2] = shift - ((1 - a) ** 6 * ends[0] + a**6 * ends[1])
        return np.asarray(line, dtype=np.float64)

    def evaluate(params: Floats) -> Floats:
        a, t = params[:, 0], 1.0 - params[:, 1]
        edge = rim(corner_front + a * (corner_rear - corner_front))
        middle = centre(a)
        head, tail = rim(t * corner_front), rim(1.0 - t * (1.0 - corner_rear))
        corner_f, corner_r = rim(np.array([corner_front]))[0], rim(np.array([corner_rear]))[0]

        def coons(weight: Floats) -> Floats:
            w, b = weight[:, None], a[:, None]
            lengthways = (1 - w) * middle + w * edge
            crossways = (1 - b) * head + b * tail
            corners = (1 - b) * ((1 - w) * front + w * corner_f) + b * ((1 - w) * rear + w * corner_r)
            return np.asarray(lengthways + crossways - corners, dtype=np.float64)

        points = coons(t)
        # Crown: flat across the centre line, falling towards the rim.
        points[:, 2] = coons(0.75 * t**2 + 0.25 * t**4)[:, 2]
        points[t <= 0, 1] = 0.0
        return points

    return Patch(evaluate, 1.0)
