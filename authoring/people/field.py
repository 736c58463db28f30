"""Signed distance fields: the shapes of bodies and clothes. Distances are in metres, and negative inside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

Array = npt.NDArray[np.float64]
Field = Callable[[Array], Array]
"""Maps (N, 3) points of the figure's frame to (N,) distances."""

_SAMPLES = 96


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """The frame of a bone: `figure_from_local` is (3, 3), its columns the bone's x (front), y (left), z (up) axes."""

    origin: Array
    figure_from_local: Array

    def to_local(self, points: Array) -> Array:
        """(N, 3) points of the figure's frame in this frame."""
        # Written out, not a matrix product: the same sums in the same order whatever BLAS is linked.
        away, axes = points - self.origin, self.figure_from_local
        return np.asarray(away[:, 0:1] * axes[0] + away[:, 1:2] * axes[1] + away[:, 2:3] * axes[2])

    def at(self, x: float, y: float, z: float) -> Array:
        """A local point in the figure's frame, (3,)."""
        return np.asarray(self.origin + self.figure_from_local @ np.array([x, y, z]))

    def child(self, offset: Sequence[float], turn: Array | None = None) -> Frame:
        """The frame at a local offset, turned by a (3, 3) rotation of its own."""
        matrix = self.figure_from_local if turn is None else self.figure_from_local @ turn
        return Frame(self.at(*offset), matrix)


@dataclass(frozen=True, slots=True)
class Fold:
    """Wrinkles of cloth on a loft: waves along z, highest at `z`, curved around the limb."""

    z: float
    spread: float
    depth: float
    wavelength: float
    phase: float = 0.0


def loft(
    frame: Frame,
    stations: Sequence[Sequence[float]],
    *,
    cap: float | tuple[float, float] = 0.02,
    power: float = 2.0,
    folds: Sequence[Fold] = (),
) -> Field:
    """Returns a tapered limb with cross-sections along the z axis of a frame: ellipses (`power` 2) or rounder boxes
    (more) along the frame's z axis.

    Args:
        frame: frame of the limb.
        stations: rows of (z, centre x, centre y, half depth along x, half width along y), metres, in any order of z.
        cap: length of the rounded ends beyond the lowest and the highest station, metres.
        power: the exponent of the cross section.
        folds: waves of the surface.
    """
    rows = np.array(sorted(tuple(row) for row in stations))
    grid = np.linspace(rows[0, 0], rows[-1, 0], _SAMPLES)
    table = PchipInterpolator(rows[:, 0], rows[:, 1:], axis=0)(grid)
    cap_low, cap_high = (cap, cap) if isinstance(cap, float) else cap

    def distance(points: Array) -> Array:
        local = frame.to_local(points)
        z = np.clip(local[:, 2], grid[0], grid[-1])
        centre_x, centre_y, depth, width = (np.interp(z, grid, table[:, k]) for k in range(4))
        beyond = local[:, 2] - z
        reach = np.where(beyond < 0, cap_low, cap_high)
        x, y = local[:, 0] - centre_x, local[:, 1] - centre_y
        across = (np.abs(x / depth) ** power + np.abs(y / width) ** power) ** (2.0 / power)
        ratio = np.sqrt(across + (beyond / reach) ** 2)
        slope = np.sqrt((x / depth**2) ** 2 + (y / width**2) ** 2 + (beyond / reach**2) ** 2)
        result = np.where(slope > 1e-9, ratio * (ratio - 1.0) / np.maximum(slope, 1e-9), -np.minimum(depth, width))
        for fold in folds:
            angle = np.arctan2(y, x)
            bend = 1.3 * np.sin(angle + fold.phase) + 0.6 * np.sin(2.0 * angle + 2.3 * fold.phase)
            wave = np.sin(2.0 * np.pi * local[:, 2] / fold.wavelength + 2.0 * bend + fold.phase)
            result = result - fold.depth * wave * np.exp(-(((local[:, 2] - fold.z) / fold.spread) ** 2))
        return np.asarray(result)

    return distance


def ellipsoid(frame: Frame, centre: Sequence[float], radii: Sequence[float]) -> Field:
    """Returns an ellipsoid along the axes of a frame."""
    middle, size = np.array(centre, dtype=np.float64), np.array(radii, dtype=np.float64)

    def distance(points: Array) -> Array:
        local = frame.to_local(points) - middle
        ratio = np.linalg.norm(local / size, axis=1)
        slope = np.linalg.norm(local / size**2, axis=1)
        return np.asarray(np.where(slope > 1e-9, ratio * (ratio - 1.0) / np.maximum(slope, 1e-9), -size.min()))

    return distance


def capsule(
    frame: Frame, start: Sequence[float], end: Sequence[float], radius: float, end_radius: float = 0.0
) -> Field:
    """Returns a rod with round ends; it narrows to `end_radius` if that is not 0."""
    a, b = frame.at(*start), frame.at(*end)
    last = end_radius or radius

    def distance(points: Array) -> Array:
        axis = b - a
        share = np.clip((points - a) @ axis / (axis @ axis), 0.0, 1.0)
        return np.asarray(np.linalg.norm(points - a - share[:, None] * axis, axis=1) - radius - (last - radius) * share)

    return distance


def rounded_box(frame: Frame, centre: Sequence[float], half: Sequence[float], radius: float) -> Field:
    """Returns a box with rounded edges; `half` are its outer half sizes."""
    middle, size = np.array(centre, dtype=np.float64), np.array(half, dtype=np.float64) - radius

    def distance(points: Array) -> Array:
        over = np.abs(frame.to_local(points) - middle) - size
        outside = np.linalg.norm(np.maximum(over, 0.0), axis=1)
        return np.asarray(outside + np.minimum(over.max(axis=1), 0.0) - radius)

    return distance


def below(frame: Frame, z: float, slope: Sequence[float] = (0.0, 0.0)) -> Field:
    """Returns the half-space below the plane z = `z` + slope · (x, y)."""
    normal = np.array([-slope[0], -slope[1], 1.0])
    length = float(np.linalg.norm(normal))

    def distance(points: Array) -> Array:
        return np.asarray((frame.to_local(points) @ normal - z) / length)

    return distance


def blend(fields: Sequence[Field], radius: float) -> Field:
    """Returns the union of all shapes with smooth transitions of width `radius`, metres."""

    def distance(points: Array) -> Array:
        result = fields[0](points)
        for other in fields[1:]:
            value = other(points)
            overlap = np.maximum(radius - np.abs(result - value), 0.0)
            result = np.minimum(result, value) - overlap**2 / (4.0 * radius)
        return result

    return distance


def attach(body: Field, limb: Field, joint: Array, *, radius: float, reach: float) -> Field:
    """Returns the union of `body` and `limb`, with a smooth transition near `joint` only, so that a hand beside the hip
    does not merge with it.
    """

    def distance(points: Array) -> Array:
        a, b = body(points), limb(points)
        near = np.exp(-((np.linalg.norm(points - joint, axis=1) / reach) ** 2))
        width = radius * near + 0.003
        overlap = np.maximum(width - np.abs(a - b), 0.0)
        return np.asarray(np.minimum(a, b) - overlap**2 / (4.0 * width))

    return distance


def cut(shape: Field, removed: Field, radius: float = 0.012) -> Field:
    """Returns `shape` without `removed`; the new edge is rounded with `radius`, metres."""

    def distance(points: Array) -> Array:
        a, b = shape(points), -removed(points)
        overlap = np.maximum(radius - np.abs(a - b), 0.0)
        return np.maximum(a, b) + overlap**2 / (4.0 * radius)

    return distance


def union(fields: Sequence[Field]) -> Field:
    """Returns the union of all shapes with sharp edges."""

    def distance(points: Array) -> Array:
        return np.asarray(np.minimum.reduce([field(points) for field in fields]))

    return distance


def gradient(field: Field, points: Array, step: float = 1e-3) -> Array:
    """Returns the gradient of a field at (N, 3) points, by central differences of length `step`, metres."""
    columns = []
    for axis in np.eye(3) * step:
        columns.append(field(points + axis) - field(points - axis))
    return np.stack(columns, axis=1) / (2.0 * step)
