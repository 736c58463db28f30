"""Cube maps as rough surfaces mirror them.

Faces lie in OpenGL's order (+x, -x, +y, -y, +z, -z of a cube whose y points up in the world, so that its z points
south): the order in which MuJoCo keeps them.
"""

from __future__ import annotations

from gear.values.geometry import Array


def mirrored_levels(radiance: Array) -> tuple[Array, ...]:
    """(6, n, n, 3) to the chain of its means: (6, n, n, 3), (6, n / 2, n / 2, 3), ..."""
    levels = [radiance]
    while levels[-1].shape[1] > 1:
        half = levels[-1].shape[1] // 2
        even = levels[-1][:, : 2 * half, : 2 * half]
        levels.append(even.reshape(6, half, 2, half, 2, 3).mean(axis=(2, 4)))
    return tuple(levels)
