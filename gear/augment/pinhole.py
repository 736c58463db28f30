"""Converts pinhole intrinsics and boxes in index pixels for pictures that are mirrored or cropped."""

from __future__ import annotations

from dataclasses import replace

from gear.augment.geometry import Window, cut_box
from gear.values.geometry import Intrinsics
from gear.values.ground_truth import BoxPx


def mirrored_pinhole(pinhole: Intrinsics) -> Intrinsics:
    """Returns the intrinsics of a picture that is mirrored left to right.

    Args:
        pinhole: intrinsics of the picture before.
    """
    if pinhole.principal_px is None:
        return pinhole
    return replace(pinhole, principal_px=(pinhole.width_px - 1 - pinhole.cx_px, pinhole.cy_px))


def windowed_pinhole(pinhole: Intrinsics, window: Window) -> Intrinsics:
    """Returns the intrinsics of a picture that is cropped and resized. fx and fy differ where rounded sizes
    stretch the crop.

    Args:
        pinhole: intrinsics of the whole picture. If its `principal_px` is None (the picture's middle), that of the
            result is None, too; the window must then have the picture's centre.
        window: the part that is cropped, and its size after resizing.
    """
    focal_px, focal_y_px = pinhole.fx_px * window.scale_x, pinhole.fy_px * window.scale_y
    principal_px = None
    if pinhole.principal_px is not None:
        left, top, _, _ = cut_index_box((pinhole.cx_px, pinhole.cy_px, pinhole.cx_px, pinhole.cy_px), window)
        principal_px = (left, top)
    own_focal_y_px = None if focal_y_px == focal_px else focal_y_px
    return Intrinsics(window.out_width_px, window.out_height_px, focal_px, own_focal_y_px, principal_px)


def cut_index_box(box_px: BoxPx, window: Window) -> BoxPx:
    """Converts a box from index pixels of the picture to index pixels of the window's output; the result is not
    clipped.

    Args:
        box_px: left, top, right and bottom; in index pixels the centre of the first pixel is 0.
        window: the part to crop, and the size after resizing.
    """
    left, top, right, bottom = box_px
    edges = cut_box((left + 0.5, top + 0.5, right + 0.5, bottom + 0.5), window)
    return (edges[0] - 0.5, edges[1] - 0.5, edges[2] - 0.5, edges[3] - 0.5)


def index_frame(width_px: int, height_px: int) -> BoxPx:
    """Returns the outer borders of a picture as a box (left, top, right, bottom) in index pixels: left and top are
    -0.5.

    Args:
        width_px, height_px: size of the picture.
    """
    return (-0.5, -0.5, width_px - 0.5, height_px - 0.5)
