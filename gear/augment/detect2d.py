"""Moving samples of 2D detection: masks are moved with the picture, and boxes are measured on them again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gear.augment.geometry import Geometry, Window, cut_box, cut_map, cut_picture, flip_array, flip_box
from gear.formats import rle
from gear.plugins.tasks.detect2d import VIEW, Detect2dSample, Object2d
from gear.values.ground_truth import BoxPx

LEAST_KEPT = 0.3
"""What shows a smaller share of its seen pixels in a window is to be ignored there."""

LEAST_SIDE_PX = 4.0
"""What is narrower or lower in a window is to be ignored there."""


def flip(sample: Detect2dSample) -> Detect2dSample:
    """Picture, boxes and masks in a mirror."""
    height, width = sample.images[VIEW].shape[:2]
    return replace(
        sample,
        images={name: flip_array(picture) for name, picture in sample.images.items()},
        surfaces=(),
        objects=tuple(_flipped(thing, height, width) for thing in sample.objects),
    )


def _flipped(thing: Object2d, height: int, width: int) -> Object2d:
    left, top, right, bottom = (round(v) for v in thing.box_px)
    mask = rle.decode(thing.rle, height, width)[top:bottom, left:right]
    return replace(
        thing,
        box_px=flip_box(thing.box_px, width),
        amodal_box_px=flip_box(thing.amodal_box_px, width),
        rle=rle.encode_crop(flip_array(mask), width - right, top, height, width),
    )


def cut(sample: Detect2dSample, window: Window) -> Detect2dSample:
    """What the window shows. Objects that it does not show are left out; of which it shows little, ignored.

    How much of a silhouette lies outside is estimated by its box, since silhouettes are not stored; the rest is
    measured. Distances remain those of the scene.
    """
    height, width = sample.images[VIEW].shape[:2]
    moved = (_cut(thing, window, height, width) for thing in sample.objects)
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        objects=tuple(thing for thing in moved if thing is not None),
    )


def _cut(thing: Object2d, window: Window, height: int, width: int) -> Object2d | None:
    out_height, out_width = window.out_height_px, window.out_width_px
    if _overlap(cut_box(thing.box_px, window), out_height, out_width) <= 0:
        return None
    mask = cut_map(rle.decode(thing.rle, height, width).astype(np.uint8), window, 0).astype(np.bool_)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return None
    left, top, right, bottom = int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1
    area = int(mask.sum())
    # Padding shows nothing, neither of what lies outside the picture.
    in_picture = _inside(thing.amodal_box_px, height, width)
    pictured = _area(in_picture) * window.scale_x * window.scale_y
    shown = min(1.0, _overlap(cut_box(in_picture, window), out_height, out_width) / pictured) if pictured > 0 else 0.0
    kept = min(1.0, area / (thing.area_px * window.scale_x * window.scale_y))
    visible, inside = thing.visible_fraction * kept, (1 - thing.truncated_fraction) * shown
    return replace(
        thing,
        is_ignored=thing.is_ignored or kept < LEAST_KEPT or min(right - left, bottom - top) < LEAST_SIDE_PX,
        box_px=(float(left), float(top), float(right), float(bottom)),
        amodal_box_px=cut_box(thing.amodal_box_px, window),
        area_px=area,
        rle=rle.encode_crop(mask[top:bottom, left:right], left, top, out_height, out_width),
        visible_fraction=visible,
        occluded_fraction=min(1.0, max(0.0, 1 - visible / inside)) if inside > 0 else 1.0,
        truncated_fraction=1 - inside,
    )


def _overlap(box_px: BoxPx, height: int, width: int) -> float:
    """Area of a box inside a picture."""
    return _area(_inside(box_px, height, width))


def _inside(box_px: BoxPx, height: int, width: int) -> BoxPx:
    """A box cut at a picture's borders; of one that lies outside nothing is left, or less."""
    left, top, right, bottom = box_px
    return (max(left, 0.0), max(top, 0.0), min(right, width), min(bottom, height))


def _area(box_px: BoxPx) -> float:
    left, top, right, bottom = box_px
    return max(0.0, right - left) * max(0.0, bottom - top)


GEOMETRY: Geometry[Detect2dSample] = Geometry(flip=flip, cut=cut)
