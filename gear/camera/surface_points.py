"""Points on regular grids on triangles, without random draws."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

import numpy as np
import numpy.typing as npt

Real = TypeVar("Real", np.float32, np.float64)


def longest_edges(corners: npt.NDArray[Real]) -> npt.NDArray[Real]:
    """Returns the (N,) lengths of the longest edges of triangles.

    Args:
        corners: (N, 3, 3) corners of the triangles.
    """
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    longest = np.maximum(np.linalg.norm(along, axis=1), np.linalg.norm(across, axis=1))
    return np.asarray(np.maximum(longest, np.linalg.norm(across - along, axis=1)), corners.dtype)


def points_on(corners: npt.NDArray[Real], steps: npt.NDArray[np.int64]) -> Iterator[npt.NDArray[Real]]:
    """Makes points on triangles, on a regular grid on each triangle.

    Args:
        corners: (N, 3, 3) corners of the triangles.
        steps: (N,) int64, the number of parts into which each edge of a triangle is cut, at least 1.

    Yields:
        One (M, 3) array for each distinct value in `steps`, smallest first: the points of all triangles with that
        value.
    """
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    for step in np.unique(steps).tolist():
        u, v = ((grid.reshape(-1) / step).astype(corners.dtype) for grid in np.mgrid[0 : step + 1, 0 : step + 1])
        inside = u + v <= 1
        chosen = steps == step
        of_each = u[inside, None] * along[chosen, None] + v[inside, None] * across[chosen, None]
        yield (corners[chosen, None, 0] + of_each).reshape(-1, 3)
