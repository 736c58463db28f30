"""Moving samples of stereo 3D detection: in a mirror the right camera becomes the left one.

Boxes in the picture follow from those in space, by the task's own formulas. Windows share the picture's middle, because
a calibration has its principal point there; they change the focal length and leave metres alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from gear.augment.geometry import Geometry, Window, cut_box, cut_picture, flip_array
from gear.formats.kitti_object import Calibration, clip_box, truncation
from gear.groundtruth.boxes import Box3d, project_box
from gear.plugins.tasks.stereo3d import LEFT, RIGHT, Object3d, Stereo3dSample
from gear.values.geometry import Intrinsics, wrap_angle_rad
from gear.values.ground_truth import BoxPx

EVERYWHERE: BoxPx = (-math.inf, -math.inf, math.inf, math.inf)


def flip(sample: Stereo3dSample) -> Stereo3dSample:
    """The pair in a mirror: x is turned round about the right camera, which is now the left one.

    How much of an object is covered was measured by the left camera, and is taken over for the right one.
    """
    baseline_m = sample.calibration.baseline_m
    images = {LEFT: flip_array(sample.images[RIGHT]), RIGHT: flip_array(sample.images[LEFT])}
    boxes = [(thing, _mirrored(thing.box, baseline_m)) for thing in sample.objects]
    return replace(sample, images=images, surfaces=(), objects=tuple(_projected(boxes, sample.calibration.intrinsics)))


def _mirrored(box: Box3d, baseline_m: float) -> Box3d:
    x, y, z = box.bottom_m
    return replace(box, bottom_m=(baseline_m - x, y, z), rotation_y_rad=wrap_angle_rad(math.pi - box.rotation_y_rad))


def cut(sample: Stereo3dSample, window: Window) -> Stereo3dSample:
    """What a window in the middle shows of both pictures, with the calibration that belongs to it.

    Raises:
        ValueError: the window does not share the picture's middle.
    """
    height, width = sample.images[LEFT].shape[:2]
    if 2 * window.left_px + window.width_px != width or 2 * window.top_px + window.height_px != height:
        raise ValueError(f"a window of a stereo pair shares the picture's middle, got {window}")
    before = sample.calibration.intrinsics
    intrinsics = Intrinsics(window.out_width_px, window.out_height_px, before.focal_px * window.scale_x)
    area = window.scale_x * window.scale_y
    boxes = [(replace(thing, visible_px=round(thing.visible_px * area)), thing.box) for thing in sample.objects]
    return replace(
        sample,
        images={name: cut_picture(picture, window) for name, picture in sample.images.items()},
        surfaces=(),
        calibration=Calibration(intrinsics=intrinsics, baseline_m=sample.calibration.baseline_m),
        objects=tuple(_projected(boxes, intrinsics, _shown(window, width, height))),
    )


def _shown(window: Window, width: int, height: int) -> BoxPx:
    """Where the picture lies in the window, in index pixels; the rest of the window is padding."""
    left, top, right, bottom = cut_box((0.0, 0.0, float(width), float(height)), window)
    return (left, top, right - 1, bottom - 1)


def _projected(
    boxes: list[tuple[Object3d, Box3d]], intrinsics: Intrinsics, shown: BoxPx = EVERYWHERE
) -> Iterator[Object3d]:
    """The objects at their new places; those that fall outside the picture are left out."""
    for thing, box in boxes:
        whole = project_box(box.corners_m, intrinsics)
        clipped = None if whole is None else clip_box(_common(whole, shown), intrinsics)
        if whole is not None and clipped is not None:
            yield replace(thing, box=box, box_px=clipped, truncated=truncation(whole, clipped))


def _common(one: BoxPx, two: BoxPx) -> BoxPx:
    return (max(one[0], two[0]), max(one[1], two[1]), min(one[2], two[2]), min(one[3], two[3]))


GEOMETRY: Geometry[Stereo3dSample] = Geometry(flip=flip, cut=cut, is_centred=True)
