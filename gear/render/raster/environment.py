"""Mip levels of cube maps (environment maps). Rough surfaces reflect the coarser levels.

Faces are in OpenGL's and MuJoCo's order: +x, -x, +y, -y, +z, -z of a cube whose y axis points up in the world and whose
z axis points south.
"""

from __future__ import annotations

from gear.values.geometry import Array


def mip_chain(radiance: Array) -> tuple[Array, ...]:
    """The mip levels of a cube map; each texel is the mean of 2 x 2 texels of the previous level.

    Args:
        radiance: (6, n, n, 3) float64, the finest level.

    Returns:
        The levels, finest first: arrays of shape (6, n, n, 3), (6, n // 2, n // 2, 3), ..., (6, 1, 1, 3).
    """
    levels = [radiance]
    while levels[-1].shape[1] > 1:
        half = levels[-1].shape[1] // 2
        even = levels[-1][:, : 2 * half, : 2 * half]
        levels.append(even.reshape(6, half, 2, half, 2, 3).mean(axis=(2, 4)))
    return tuple(levels)
