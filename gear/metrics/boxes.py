"""Overlaps between all pairs of two lists of boxes: 2D boxes in the picture, rotated footprints on the ground, and
3D boxes.
"""

from __future__ import annotations

import numpy as np

from gear.values.geometry import Array

MAX_CORNERS = 8
"""Largest number of corners that the intersection of two rectangles can have."""


def intersections_px2(boxes: Array, other_boxes: Array) -> Array:
    """The intersection areas of all pairs of two lists of 2D boxes.

    Args:
        boxes, other_boxes: (N, 4) and (M, 4) boxes: left, top, right, bottom in edge pixels.

    Returns:
        (N, M) areas in square pixels.
    """
    low = np.maximum(boxes[:, None, :2], other_boxes[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], other_boxes[None, :, 2:])
    return np.asarray(np.prod(np.clip(high - low, 0, None), axis=-1))


def iou_2d(boxes: Array, other_boxes: Array) -> Array:
    """The intersection over union of all pairs of two lists of 2D boxes.

    Args:
        boxes, other_boxes: (N, 4) and (M, 4) boxes: left, top, right, bottom in edge pixels.

    Returns:
        (N, M) shares, 0..1.
    """
    shared = intersections_px2(boxes, other_boxes)
    return _over(shared, _areas(boxes)[:, None] + _areas(other_boxes)[None] - shared)


def intersection_over_first(boxes: Array, other_boxes: Array) -> Array:
    """The share of each box in one list that lies inside each box of another list.

    Args:
        boxes, other_boxes: (N, 4) and (M, 4) boxes: left, top, right, bottom in edge pixels.

    Returns:
        (N, M) intersection area over the area of the box of `boxes`, 0..1.
    """
    return _over(
        intersections_px2(boxes, other_boxes), np.broadcast_to(_areas(boxes)[:, None], (len(boxes), len(other_boxes)))
    )


def iou_ground_and_space(boxes: Array, other_boxes: Array) -> tuple[Array, Array]:
    """Computes the intersection over union of all pairs of KITTI's 3D boxes, on the ground and in space.

    Args:
        boxes, other_boxes: (N, 7) and (M, 7) boxes: height, width, length, x, y, z of the middle of the bottom face,
            and rotation_y, in the camera's frame with y down.

    Returns:
        (N, M) intersection over union of the footprints, and of the volumes.
    """
    shared_m2 = footprint_intersections_m2(boxes, other_boxes)
    ground_a, ground_b = boxes[:, 1] * boxes[:, 2], other_boxes[:, 1] * other_boxes[:, 2]
    ground = _over(shared_m2, ground_a[:, None] + ground_b[None] - shared_m2)
    bottom = np.minimum(boxes[:, None, 4], other_boxes[None, :, 4])
    top = np.maximum((boxes[:, 4] - boxes[:, 0])[:, None], (other_boxes[:, 4] - other_boxes[:, 0])[None])
    shared_m3 = shared_m2 * np.clip(bottom - top, 0, None)
    volume = (ground_a * boxes[:, 0])[:, None] + (ground_b * other_boxes[:, 0])[None] - shared_m3
    return ground, _over(shared_m3, volume)


def footprint_intersections_m2(boxes: Array, other_boxes: Array) -> Array:
    """The intersection areas of the footprints of all pairs of two lists of KITTI's 3D boxes.

    Args:
        boxes, other_boxes: (N, 7) and (M, 7) boxes: height, width, length, x, y, z of the middle of the bottom face,
            and rotation_y, in the camera's frame with y down.

    Returns:
        (N, M) areas in square metres.
    """
    shared = np.zeros((len(boxes), len(other_boxes)))
    reach = (np.hypot(boxes[:, 1], boxes[:, 2])[:, None] + np.hypot(other_boxes[:, 1], other_boxes[:, 2])[None]) / 2
    near = np.hypot(boxes[:, None, 3] - other_boxes[None, :, 3], boxes[:, None, 5] - other_boxes[None, :, 5]) < reach
    first, second = np.nonzero(near)
    if first.size:
        shared[first, second] = _convex_intersections(footprints(boxes)[first], footprints(other_boxes)[second])
    return shared


def footprints(boxes: Array) -> Array:
    """The corners of the footprints of KITTI's 3D boxes on the ground.

    Args:
        boxes: (N, 7) height, width, length, x, y, z of the middle of the bottom face, and rotation_y, in the camera's
            frame with y down.

    Returns:
        (N, 4, 2) corners (x, z) in metres, counter-clockwise in (x, z).
    """
    c, s = np.cos(boxes[:, 6]), np.sin(boxes[:, 6])
    along = np.array([0.5, -0.5, -0.5, 0.5]) * boxes[:, 2:3]
    across = np.array([0.5, 0.5, -0.5, -0.5]) * boxes[:, 1:2]
    x = c[:, None] * along + s[:, None] * across + boxes[:, 3:4]
    z = -s[:, None] * along + c[:, None] * across + boxes[:, 5:6]
    return np.stack([x, z], axis=-1)


def _convex_intersections(polygons: Array, clips: Array) -> Array:
    """Areas of the intersections of (P, 4, 2) quadrangles with (P, 4, 2) others, all counter-clockwise.

    The algorithm of Sutherland and Hodgman, for all pairs at once: for each clipping edge, corners inside are kept and
    new ones are made where an edge crosses. The remaining corners are moved to the front, and the rest of the array is
    filled with the first corner, which adds no area.
    """
    corners = polygons
    for edge in range(4):
        start, end = clips[:, edge], clips[:, (edge + 1) % 4]
        direction = (end - start)[:, None]
        offset = corners - start[:, None]
        side = direction[..., 0] * offset[..., 1] - direction[..., 1] * offset[..., 0]
        following, side_following = np.roll(corners, -1, axis=1), np.roll(side, -1, axis=1)
        inside = side >= 0
        crosses = inside != (side_following >= 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(crosses, side / (side - side_following), 0.0)
        cut = corners + share[..., None] * (following - corners)
        candidates = np.stack([corners, cut], axis=2).reshape(len(corners), -1, 2)
        kept = np.stack([inside, crosses], axis=2).reshape(len(corners), -1)
        order = np.argsort(~kept, axis=1, kind="stable")[:, :MAX_CORNERS]
        packed = np.take_along_axis(candidates, order[..., None], axis=1)
        valid = np.take_along_axis(kept, order, axis=1)
        corners = np.where(valid[..., None], packed, np.where(valid[:, :1, None], packed[:, :1], 0.0))
    x, z = corners[..., 0] - corners[:, :1, 0], corners[..., 1] - corners[:, :1, 1]
    twice = x * np.roll(z, -1, axis=1) - z * np.roll(x, -1, axis=1)
    return np.asarray(np.abs(twice.sum(axis=1)) / 2)


def _areas(boxes: Array) -> Array:
    return np.asarray((boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1]))


def _over(part: Array, whole: Array) -> Array:
    return np.asarray(np.where(whole > 0, part / np.where(whole > 0, whole, 1.0), 0.0))
