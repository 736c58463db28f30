"""Positions and surface normals of pixels, computed from depth alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.scene import CameraRecord

STRIP_ROWS = 32
"""Number of rows per strip. It is small, so the arrays of a strip stay in the processor's cache."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Strip:
    """World positions and normals of the surfaces that a strip of h rows of a view shows.

    Attributes:
        rows: the range of rows in the picture.
        is_seen: (h, W) bool, True where a surface was hit.
        position_m: (3, h, W) float32 vectors from the camera to the surface, world axes; zero where nothing was hit.
        normal: (3, h, W) float32 unit normals, world axes, on the camera's side; zero where nothing was hit.
    """

    rows: slice
    is_seen: npt.NDArray[np.bool_]
    position_m: FloatImage
    normal: FloatImage


def strips_of(depth_m: FloatImage, camera: CameraRecord) -> Iterator[Strip]:
    """Computes the positions and normals of a view, in strips of rows from top to bottom.

    A normal is the cross product of two differences of positions, one along the row and one along the column. Each
    difference is taken to one neighbour only: the neighbour that more likely lies on the same surface. On a plane, 1/z
    is linear over the picture. The neighbour on the side with the smaller second difference of 1/z is therefore used.
    Silhouettes and edges of road paint (some millimetres above the road) therefore do not tilt a normal.

    Args:
        depth_m: (H, W) float32 planar z, NaN where nothing was hit.
        camera: the camera that takes the picture.
    """
    height, width = depth_m.shape
    pinhole = camera.intrinsics
    x = ((np.arange(width) - pinhole.cx_px) / pinhole.fx_px).astype(np.float32)
    y = ((np.arange(height) - pinhole.cy_px) / pinhole.fy_px).astype(np.float32)[:, None]
    rotation = camera.world_from_camera_transform.rotation.astype(np.float32)
    for top in range(0, height, STRIP_ROWS):
        bottom = min(top + STRIP_ROWS, height)
        first, last = max(top - 2, 0), min(bottom + 2, height)
        z = depth_m[first:last]
        position = np.stack([axis[0] * (x * z) + axis[1] * (y[first:last] * z) + axis[2] * z for axis in rotation])
        inside = slice(top - first, bottom - first)
        across = _along(position, z, 1)[:, inside]
        down = _along(position, z, 0)[:, inside]
        is_seen = z[inside] == z[inside]
        yield Strip(
            rows=slice(top, bottom),
            is_seen=is_seen,
            position_m=np.where(is_seen, position[:, inside], np.float32(0)),
            normal=_unit_cross(down, across),
        )


def _along(position: FloatImage, z: FloatImage, axis: int) -> FloatImage:
    """(3, h, W) differences between the positions of a pixel and of its better neighbour along one axis of the
    picture.
    """
    step = np.diff(position, axis=axis + 1)
    bend = np.abs(np.diff(1 / z, n=2, axis=axis))
    bend[np.isnan(bend)] = np.inf
    # The second difference around a pixel is the one ahead for the pixel before it, and the one behind for the next.
    ahead = np.pad(bend, _pads(axis, 0, 2), constant_values=np.inf)
    behind = np.pad(bend, _pads(axis, 2, 0), constant_values=np.inf)
    # At the picture's border, and between two silhouettes, the neighbour nearer in depth is used.
    fall = np.abs(np.diff(z, axis=axis))
    fall[np.isnan(fall)] = np.inf
    is_nearer = np.pad(fall, _pads(axis, 0, 1), constant_values=np.inf) < np.pad(
        fall, _pads(axis, 1, 0), constant_values=np.inf
    )
    is_ahead = np.where(ahead == behind, is_nearer, ahead < behind)
    return np.where(is_ahead, np.pad(step, [(0, 0), *_pads(axis, 0, 1)]), np.pad(step, [(0, 0), *_pads(axis, 1, 0)]))


def _pads(axis: int, before: int, after: int) -> list[tuple[int, int]]:
    pads = [(0, 0), (0, 0)]
    pads[axis] = (before, after)
    return pads


def _unit_cross(a: FloatImage, b: FloatImage) -> FloatImage:
    normal = np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    length = np.sqrt(np.einsum("ihw,ihw->hw", normal, normal))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.nan_to_num(normal / length, nan=0.0, posinf=0.0, neginf=0.0), np.float32)
