"""Signed distances in a plane (negative inside), for shapes that are cut into sheets: windows, lamps, arches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry import Polygon  # type: ignore[import-untyped]

from authoring.mesh import Floats

__all__ = ["Shape", "disc", "rounded"]

Shape = Callable[[Floats], Floats]


def disc(x: float, y: float, radius: float) -> Shape:
    """Returns the signed distance of a circle."""
    return lambda p: np.hypot(p[:, 0] - x, p[:, 1] - y) - radius


def rounded(corners: ArrayLike, radius: float = 0.0, grow: float = 0.0) -> Shape:
    """Returns the signed distance of a (C, 2) polygon with rounded corners, enlarged by `grow` metres.

    A polygon that is too small for the radius raises a ValueError.
    """
    shrunk = Polygon(np.asarray(corners, dtype=np.float64)).buffer(-radius, join_style="mitre")
    if shrunk.is_empty or shrunk.geom_type != "Polygon":
        raise ValueError(f"polygon {np.asarray(corners).tolist()} has no room for corners of radius {radius}")
    ring = np.asarray(shrunk.exterior.coords, dtype=np.float64)
    start, along = ring[:-1], np.diff(ring, axis=0)
    length2 = np.maximum((along**2).sum(axis=1), 1e-18)

    def distance(p: Floats) -> Floats:
        to = p[:, None, :] - start[None]
        t = np.clip((to * along).sum(axis=-1) / length2, 0, 1)
        near = np.sqrt(((to - t[..., None] * along) ** 2).sum(axis=-1)).min(axis=1)
        y0, y1 = start[:, 1], start[:, 1] + along[:, 1]
        crosses = (y0 > p[:, 1:2]) != (y1 > p[:, 1:2])
        rise = np.where(np.abs(along[:, 1]) > 1e-12, along[:, 1], 1.0)
        at = start[:, 0] + (p[:, 1:2] - y0) / rise * along[:, 0]
        inside = (crosses & (p[:, :1] < at)).sum(axis=1) % 2 == 1
        return np.asarray(np.where(inside, -near, near) - radius - grow, dtype=np.float64)

    return distance
