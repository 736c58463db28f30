"""MuJoCo's primitive shapes as triangles, in the frames of their geoms."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
import numpy.typing as npt

from gear.render.pinhole import FAR_M
from gear.values.geometry import Array

_AROUND, _UPWARDS = 48, 24
_BOX_TEXTURE = ((1, 2), (0, 2), (0, 1))
"""Texture axes of the sides of a box that face along x, y and z. The first number is the axis along which u increases,
the second the axis against which v increases. As in MuJoCo, opposite sides have the same axes.
"""

_GEOM = mujoco.mjtGeom


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """An indexed triangle mesh with V vertices and T triangles.

    Attributes:
        positions_m: (V, 3) positions, metres.
        normals: (V, 3) unit normals.
        texcoords: (V, 2) texture coordinates; v increases downwards.
        corners: (T, 3) int64 vertex indices, counter-clockwise as seen from outside.
    """

    positions_m: Array
    normals: Array
    texcoords: Array
    corners: npt.NDArray[np.int64]


def primitive(kind: int, size_m: Array) -> Triangles:
    """Triangles of a primitive shape of MuJoCo, in the geom's frame.

    Args:
        kind: an `mjtGeom`: plane, sphere, capsule, ellipsoid, cylinder or box.
        size_m: (3,) sizes as in MuJoCo's `geom_size`.

    Raises:
        ValueError: the kind is not a primitive.
    """
    x, y, z = (float(value) for value in size_m)
    if kind == _GEOM.mjGEOM_PLANE:
        return _plane(x or FAR_M, y or FAR_M)
    if kind == _GEOM.mjGEOM_BOX:
        return _box(np.array([x, y, z]))
    if kind == _GEOM.mjGEOM_SPHERE:
        return _surface_of_revolution(_capsule_profile(x, 0.0), np.array([1.0, 1.0, 1.0]))
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        return _surface_of_revolution(_capsule_profile(1.0, 0.0), np.array([x, y, z]))
    if kind == _GEOM.mjGEOM_CAPSULE:
        return _surface_of_revolution(_capsule_profile(x, y), np.array([1.0, 1.0, 1.0]))
    if kind == _GEOM.mjGEOM_CYLINDER:
        return _cylinder(x, y)
    raise ValueError(f"no primitive shape: {_GEOM(kind).name}")


def height_field(model: mujoco.MjModel, index: int) -> Triangles:
    """The triangles of the upper surface of a height field, in the geom's frame.

    Args:
        model: the compiled world.
        index: id of the height field.
    """
    rows, columns = int(model.hfield_nrow[index]), int(model.hfield_ncol[index])
    radius_x, radius_y, top, _ = model.hfield_size[index].tolist()
    begin = int(model.hfield_adr[index])
    height = top * model.hfield_data[begin : begin + rows * columns].reshape(rows, columns).astype(np.float64)
    across, up = np.linspace(-1, 1, columns), np.linspace(-1, 1, rows)
    u, v = np.meshgrid(across, up)
    positions = np.stack([u * radius_x, v * radius_y, height], axis=-1)
    rise_y, rise_x = np.gradient(height, up * radius_y, across * radius_x)
    normals = np.stack([-rise_x, -rise_y, np.ones_like(height)], axis=-1)
    return _grid(positions, normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def _plane(half_x_m: float, half_y_m: float) -> Triangles:
    u, v = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
    positions = np.stack([u * half_x_m, v * half_y_m, np.zeros_like(u)], axis=-1)
    return _grid(positions, np.broadcast_to([0.0, 0.0, 1.0], positions.shape))


def _box(half_m: Array) -> Triangles:
    parts = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            right, up = (axis + 1) % 3, (axis + 2) % 3
            u, v = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
            positions = np.empty((2, 2, 3))
            positions[..., axis], positions[..., right], positions[..., up] = sign, sign * u, v
            normals = np.zeros((2, 2, 3))
            normals[..., axis] = sign
            across, down = _BOX_TEXTURE[axis]
            texcoords = np.stack([1 + positions[..., across], 1 - positions[..., down]], axis=-1) / 2
            parts.append(replace(_grid(positions * half_m, normals), texcoords=texcoords.reshape(-1, 2)))
    return _concatenated(parts)


def _capsule_profile(radius_m: float, half_length_m: float) -> tuple[Array, Array]:
    """Profile of a capsule from its lower to its upper pole: (N, 2) radius and height, and (N, 2) normals."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, _UPWARDS + 1)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    if half_length_m:
        normals = np.insert(normals, _UPWARDS // 2, (1.0, 0.0), axis=0)
    shift = np.zeros((len(normals), 2))
    shift[:, 1] = half_length_m * np.where(np.arange(len(normals)) <= _UPWARDS // 2, -1.0, 1.0)
    return radius_m * normals + shift, normals


def _surface_of_revolution(profile: tuple[Array, Array], scale: Array) -> Triangles:
    """A surface of revolution about z, scaled along the axes afterwards.

    Args:
        profile: (N, 2) radius and height from bottom to top, and (N, 2) normals.
        scale: (3,) factors along x, y and z.
    """
    points, slopes = profile
    around = np.linspace(0, 2 * np.pi, _AROUND + 1)
    cosine, sine = np.cos(around), np.sin(around)
    positions, normals = (
        np.stack(
            [each[:, :1] * cosine, each[:, :1] * sine, np.broadcast_to(each[:, 1:], (len(each), len(around)))], axis=-1
        )
        for each in (points, slopes)
    )
    normals = normals / scale
    return _grid(positions * scale, normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def _cylinder(radius_m: float, half_length_m: float) -> Triangles:
    level, outwards = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    rims = np.array([[radius_m, -half_length_m], [radius_m, half_length_m]])
    one = np.ones(3)
    side = _surface_of_revolution((rims, np.stack([outwards, outwards])), one)
    caps = [
        _surface_of_revolution((np.array([[0.0, -half_length_m], rims[0]]), np.stack([-level, -level])), one),
        _surface_of_revolution((np.array([rims[1], [0.0, half_length_m]]), np.stack([level, level])), one),
    ]
    return _concatenated([side, *caps])


def _grid(positions_m: Array, normals: Array) -> Triangles:
    """Triangles of a grid of (rows, columns, 3) points. Seen from outside, columns go right and rows go up."""
    rows, columns = positions_m.shape[:2]
    u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(1, 0, rows))
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    lower = np.stack([first, first + 1, first + columns + 1], axis=-1)
    upper = np.stack([first, first + columns + 1, first + columns], axis=-1)
    return Triangles(
        positions_m=positions_m.reshape(-1, 3),
        normals=np.asarray(normals).reshape(-1, 3),
        texcoords=np.stack([u, v], axis=-1).reshape(-1, 2),
        corners=np.concatenate([lower, upper]),
    )


def _concatenated(parts: list[Triangles]) -> Triangles:
    starts = np.cumsum([0, *(len(part.positions_m) for part in parts)])
    return Triangles(
        positions_m=np.concatenate([part.positions_m for part in parts]),
        normals=np.concatenate([part.normals for part in parts]),
        texcoords=np.concatenate([part.texcoords for part in parts]),
        corners=np.concatenate([part.corners + start for part, start in zip(parts, starts, strict=False)]),
    )
