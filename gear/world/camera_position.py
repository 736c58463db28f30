"""Checks that no camera is inside the ego car, where its view would be only the car."""

from __future__ import annotations

import numpy as np

from gear.values.errors import PlacementError
from gear.values.frames import Shape
from gear.values.geometry import Array
from gear.values.rig import Rig

DIRECTIONS = 96
CLOSED_SHARE = 0.9
"""A camera counts as inside the car if its view ends at the car in at least this share of all directions."""


def check_outside(rig: Rig, car: Shape, scene_name: str) -> None:
    """Checks that all cameras of a rig are outside the ego car.

    Args:
        rig: the cameras, in the car's frame.
        car: triangles of the ego car, in the same frame.
        scene_name: name of the scene, for error messages.

    Raises:
        PlacementError: a camera is inside the car; the message names the camera and its position.
    """
    for mount in rig.cameras:
        x, y, z = mount.position_m
        if enclosed_share(car, np.array(mount.position_m)) >= CLOSED_SHARE:
            where = f"camera {mount.name!r} at [{x:g}, {y:g}, {z:g}] m is inside the ego car"
            raise PlacementError(scene_name, f"{where}; change options.position_m, such as [1.5, 0, 1.65]")


def enclosed_share(shape: Shape, point_m: Array) -> float:
    """The share of directions, 0..1, in which a ray from a point hits a shape (method: Möller and Trumbore 1997).

    Args:
        shape: the triangles.
        point_m: (3,) start of the rays, in the shape's frame.
    """
    if (np.abs(point_m - shape.box_centre_m) > shape.box_size_m / 2).any():
        return 0.0
    corners = shape.vertices_m[shape.faces]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    away = point_m - corners[:, 0]
    across = np.cross(away, first)
    hits = 0
    for direction in _directions():
        normal = np.cross(direction, second)
        area = np.einsum("nd,nd->n", first, normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("nd,nd->n", away, normal) / area
            v = across @ direction / area
            distance = np.einsum("nd,nd->n", second, across) / area
            hits += bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)).any())
    return hits / DIRECTIONS


def _directions() -> Array:
    """(N, 3) unit vectors, spread evenly over the sphere (Fibonacci lattice)."""
    number = np.arange(DIRECTIONS) + 0.5
    z = 1 - 2 * number / DIRECTIONS
    turn = number * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - z * z)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])
