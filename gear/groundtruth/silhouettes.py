"""Rasterises silhouettes of triangles with the rule of GPUs: a pixel is covered if its centre is inside.

Every triangle gives one span per pixel row. Spans are accumulated as differences along the rows, or counted in sorted
order. A mesh of any size is therefore rasterised by a few array operations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array, Intrinsics

Mask = npt.NDArray[np.bool_]
Window = tuple[int, int, int, int]
"""A rectangle of whole pixels: first column, first row, one past the last column, and one past the last row, in
index pixels. It may lie outside the picture.
"""

NEAR_M = 0.1
"""Distance of the near plane along the optical axis in metres, as in the renderers; nearer parts are not projected."""

SPANS_AT_ONCE = 2_000_000


def clip_near(triangles_m: Array, near_m: float = NEAR_M) -> Array:
    """Clips (T, 3, 3) camera-frame triangles at the near plane, z = `near_m`: the part with smaller z is removed.

    A triangle of which one corner is removed becomes two triangles.

    Args:
        triangles_m: (T, 3, 3) corners in the camera's frame.
        near_m: z of the plane in metres.

    Returns:
        (N, 3, 3) corners of the remaining triangles.
    """
    front = triangles_m[..., 2] >= near_m
    count = front.sum(axis=1)
    parts = [triangles_m[count == 3]]
    one = _odd_corner_first(triangles_m[count == 1], front[count == 1])
    a, b, c = one[:, 0], one[:, 1], one[:, 2]
    parts.append(np.stack([a, _cut(a, b, near_m), _cut(a, c, near_m)], axis=1))
    two = _odd_corner_first(triangles_m[count == 2], ~front[count == 2])
    a, b, c = two[:, 0], two[:, 1], two[:, 2]
    ab, ac = _cut(a, b, near_m), _cut(a, c, near_m)
    parts += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    return np.concatenate(parts)


def project_mesh(vertices_camera_m: Array, faces: npt.NDArray[np.int32], intrinsics: Intrinsics) -> Array:
    """Projects those triangles of a mesh that face the camera.

    Args:
        vertices_camera_m: (N, 3) vertices in the camera's frame.
        faces: (M, 3) vertex indices, counter-clockwise seen from outside. Renderers do not show triangles from behind;
            a closed mesh covers the same pixels without them.
        intrinsics: intrinsics of the pinhole camera.

    Returns:
        (T, 3, 2) corners in index pixels, clipped at the near plane. In memory all values of one coordinate of one
        corner are contiguous, which makes the later operations fast.
    """
    if not len(faces):
        return np.zeros((0, 3, 2))
    if vertices_camera_m[:, 2].min() >= NEAR_M:
        pixels = np.ascontiguousarray(intrinsics.project(vertices_camera_m).T)
        corners = np.ascontiguousarray(faces.T)
        x, y = pixels[0][corners], pixels[1][corners]
    else:
        cut = intrinsics.project(clip_near(vertices_camera_m[faces]))
        x, y = np.ascontiguousarray(cut[..., 0].T), np.ascontiguousarray(cut[..., 1].T)
    # The picture's y runs down, so what is counter-clockwise to the eye has a negative area.
    facing = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]) < 0
    return np.stack([x[:, facing], y[:, facing]]).transpose(2, 1, 0)


def bounds(triangles_px: Array) -> Window:
    """The smallest window that contains the silhouette of (T, 3, 2) triangles in index pixels; without triangles
    an empty window at the origin.

    Args:
        triangles_px: (T, 3, 2) corners in index pixels.

    Returns:
        First column, first row, one past the last column, and one past the last row.
    """
    if not len(triangles_px):
        return (0, 0, 0, 0)
    low, high = np.ceil(triangles_px.min(axis=(0, 1))), np.ceil(triangles_px.max(axis=(0, 1)))
    return (int(low[0]), int(low[1]), int(high[0]), int(high[1]))


def fill(triangles_px: Array, window: Window) -> Mask:
    """Rasterises the silhouette of (T, 3, 2) triangles inside a window, as a mask.

    Args:
        triangles_px: corners in index pixels.
        window: window to rasterise.

    Returns:
        (rows, columns) bool. A pixel whose centre is on an edge is covered if the edge is a left or a top one.
    """
    x0, y0, x1, y1 = window
    columns, rows = max(0, x1 - x0), max(0, y1 - y0)
    if not columns or not rows or not len(triangles_px):
        return np.zeros((rows, columns), dtype=np.bool_)
    x, y = triangles_px.transpose(2, 1, 0)
    if (x0, y0) != (0, 0):
        x, y = x - x0, y - y0
    shown = _Shown.of(x, y, columns, rows)
    depth = np.zeros(rows * (columns + 1), dtype=np.int64)
    ends = np.cumsum(shown.heights)
    start = 0
    while start < len(ends):
        done = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, done + SPANS_AT_ONCE, side="right")))
        begins, behind = shown.spans(slice(start, stop))
        depth += np.bincount(begins, minlength=depth.size)
        depth -= np.bincount(behind, minlength=depth.size)
        start = stop
    return np.cumsum(depth.reshape(rows, columns + 1)[:, :-1], axis=1) > 0


def count(triangles_px: Array, window: Window, most_rows: int) -> int:
    """Counts the pixels of the silhouette of (T, 3, 2) triangles inside a window of any size, without a mask.

    Args:
        triangles_px: corners in index pixels.
        window: window to count in.
        most_rows: if the window has more rows, this many evenly spaced rows are counted and scaled up.

    Returns:
        The number of pixels that `fill` covers; an estimate if the window has more than `most_rows` rows.
    """
    x0, y0, x1, y1 = window
    if x0 >= x1 or y0 >= y1 or not len(triangles_px):
        return 0
    rows = min(y1 - y0, most_rows)
    step = (y1 - y0) / rows
    x, y = triangles_px.transpose(2, 1, 0)
    return round(_covered(x - x0, (y - (y0 + (step - 1) / 2)) / step, x1 - x0, rows) * step)


def _covered(x: Array, y: Array, columns: int, rows: int) -> int:
    """Number of pixels of a window at the origin that are covered by (3, T) triangles."""
    shown = _Shown.of(x, y, columns, rows)
    if shown.heights.sum() > SPANS_AT_ONCE and rows > 1:
        half = rows // 2
        return _covered(x, y, columns, half) + _covered(x, y - half, columns, rows - half)
    begins, behind = shown.spans(slice(None))
    order = np.argsort(begins, kind="stable")
    begins, reached = begins[order], np.maximum.accumulate(behind[order])
    fresh = np.maximum(begins[1:], reached[:-1])
    return int((reached[1:] - fresh).sum() + (reached[:1] - begins[:1]).sum())


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """Triangles with pixels in a window at the origin.

    Attributes:
        x, y: (3, T) corners, from top to bottom.
        first, heights: (T,) first row and number of rows of each triangle.
        columns: number of columns of the window.
    """

    x: Array
    y: Array
    first: npt.NDArray[np.int64]
    heights: npt.NDArray[np.int64]
    columns: int

    @staticmethod
    def of(x: Array, y: Array, columns: int, rows: int) -> _Shown:
        """Selects the triangles with pixels in the window among (3, T) triangles."""
        first = np.clip(np.ceil(y.min(axis=0)), 0, rows).astype(np.int64)
        last = np.clip(np.ceil(y.max(axis=0)), 0, rows).astype(np.int64)
        left, right = np.clip(np.ceil(x.min(axis=0)), 0, columns), np.clip(np.ceil(x.max(axis=0)), 0, columns)
        # Most triangles of a distant object lie between samples.
        seen = np.flatnonzero((last > first) & (right > left))
        return _Shown(*_by_row(x[:, seen], y[:, seen]), first[seen], (last - first)[seen], columns)

    def spans(self, part: slice) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """One span per row and triangle: first pixel and one past the last pixel, as indices into rows of `columns + 1`
        pixels.
        """
        x, y, first, heights = self.x[:, part], self.y[:, part], self.first[part], self.heights[part]
        with np.errstate(divide="ignore", invalid="ignore"):
            long_slope = (x[2] - x[0]) / (y[2] - y[0])
            upper_slope = (x[1] - x[0]) / (y[1] - y[0])
            lower_slope = (x[2] - x[1]) / (y[2] - y[1])
        owner = np.repeat(np.arange(len(heights)), heights)
        row = np.arange(len(owner)) + np.repeat(first - (np.cumsum(heights) - heights), heights)
        long_x = x[0][owner] + (row - y[0][owner]) * long_slope[owner]
        with np.errstate(invalid="ignore"):
            # Level edges have no slope, and no row that would ask for it.
            upper_x = x[0][owner] + (row - y[0][owner]) * upper_slope[owner]
            lower_x = x[1][owner] + (row - y[1][owner]) * lower_slope[owner]
        short_x = np.where(row < y[1][owner], upper_x, lower_x)
        left = np.clip(np.ceil(np.minimum(long_x, short_x)), 0, self.columns).astype(np.int64)
        right = np.clip(np.ceil(np.maximum(long_x, short_x)), 0, self.columns).astype(np.int64)
        base = row * (self.columns + 1)
        return base + left, base + right


def _by_row(x: Array, y: Array) -> tuple[Array, Array]:
    """Sorts the corners of (3, T) triangles from top to bottom by three compare-exchange steps."""
    for i, j in ((0, 1), (1, 2), (0, 1)):
        below = y[i] > y[j]
        for values in (x, y):
            values[i], values[j] = np.where(below, values[j], values[i]), np.where(below, values[i], values[j])
    return x, y


def _odd_corner_first(triangles: Array, odd: Mask) -> Array:
    """Rotates the corners of each triangle so that the single corner on one side of the plane is first; the winding is
    kept.
    """
    start = np.argmax(odd, axis=1)
    order = (start[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, order[..., None], axis=1)


def _cut(a: Array, b: Array, near_m: float) -> Array:
    """Intersections of the edges from `a` to `b` with z = near."""
    share = (near_m - a[:, 2]) / (b[:, 2] - a[:, 2])
    cut: Array = a + share[:, None] * (b - a)
    cut[:, 2] = near_m
    return cut
