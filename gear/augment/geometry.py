"""Geometric changes of pictures, maps and boxes: mirroring, and cropping to a window that is then resized."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Sample
from gear.values.frames import UInt8Image
from gear.values.ground_truth import BoxPx

SampleT = TypeVar("SampleT", bound=Sample)
PADDING_LEVEL = 114
"""Grey level, 0..255, of the padding in the part of a window that lies beyond the picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """A part of a picture (a crop), and the size to which the part is resized.

    Attributes:
        left_px, top_px, width_px, height_px: position and size of the part in whole edge pixels of the picture; the
            part may extend beyond the picture and is padded there.
        out_width_px, out_height_px: size after resizing.
    """

    left_px: int
    top_px: int
    width_px: int
    height_px: int
    out_width_px: int
    out_height_px: int

    @property
    def scale_x(self) -> float:
        """Horizontal scale: output pixels per pixel of the picture."""
        return self.out_width_px / self.width_px

    @property
    def scale_y(self) -> float:
        """Vertical scale: output pixels per pixel of the picture."""
        return self.out_height_px / self.height_px

    @property
    def scale(self) -> float:
        """Geometric mean of the horizontal and the vertical scale."""
        return math.sqrt(self.scale_x * self.scale_y)


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry(Generic[SampleT]):
    """The functions that mirror, crop and resize the samples of one task. Each returns a new sample and leaves its
    argument unchanged.

    Attributes:
        flip: mirrors a sample, left to right.
        cut: crops a sample to a window.
        is_centred: whether a window must have the picture's centre, because the ground truth needs the principal point
            there.
        shrink: resizes a sample to that of a camera with the same view and fewer pixels; the window is the whole
            picture. None if `cut` does the same.
        cut_depth: pastes a sample's depth into its picture (CutDepth); None for tasks without depth.
    """

    flip: Callable[[SampleT], SampleT]
    cut: Callable[[SampleT, Window], SampleT]
    is_centred: bool = False
    shrink: Callable[[SampleT, Window], SampleT] | None = None
    cut_depth: Callable[[SampleT, np.random.Generator], SampleT] | None = None


def whole_window(size_px: tuple[int, int], share: float) -> Window:
    """Returns the window that covers a whole picture and resizes it.

    Args:
        size_px: height and width of the picture.
        share: factor by which height and width are multiplied; the results are rounded to whole pixels, at least 1.
    """
    height, width = size_px
    return Window(
        left_px=0,
        top_px=0,
        width_px=width,
        height_px=height,
        out_width_px=max(1, round(share * width)),
        out_height_px=max(1, round(share * height)),
    )


def draw_window(
    size_px: tuple[int, int],
    out_px: tuple[int, int],
    scale: float,
    rng: np.random.Generator,
    *,
    is_centred: bool = False,
) -> Window:
    """Draws the position of a random crop inside a picture; a window larger than the picture contains the picture.

    Args:
        size_px: height and width of the picture.
        out_px: height and width of the window after resizing.
        scale: output pixels per pixel of the picture.
        rng: generator of the window's position.
        is_centred: whether the window must have the same centre as the picture.

    Returns:
        The window; its position is in whole pixels of the picture. With `is_centred` nothing is drawn, and the size is
        rounded so that both centres coincide.
    """
    (height, width), (out_height, out_width) = size_px, out_px
    h, w = max(1, round(out_height / scale)), max(1, round(out_width / scale))
    if is_centred:
        w = _of_parity(out_width / scale, width)
        h = _of_parity(out_height * w / out_width, height)
        top, left = (height - h) // 2, (width - w) // 2
    else:
        top, left = _between(height - h, rng), _between(width - w, rng)
    return Window(left_px=left, top_px=top, width_px=w, height_px=h, out_width_px=out_width, out_height_px=out_height)


def _of_parity(value: float, like: int) -> int:
    """The nearest positive integer with the same parity as another integer."""
    return max(2 * round((value - like % 2) / 2) + like % 2, 2 - like % 2)


def _between(room_px: int, rng: np.random.Generator) -> int:
    return int(rng.integers(min(room_px, 0), max(room_px, 0) + 1))


def flip_array(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Returns a copy of an (H, W, ...) array that is mirrored left to right.

    Args:
        array: the array.
    """
    return np.ascontiguousarray(array[:, ::-1])


def cut_picture(picture: UInt8Image, window: Window) -> UInt8Image:
    """Crops and resizes an (H, W, 3) picture: by area averages if it gets smaller, bilinearly if it gets larger.

    Args:
        picture: (H, W, 3) uint8.
        window: the part to crop, and the size after resizing. What lies beyond the picture gets the grey level
            `PADDING_LEVEL`.

    Returns:
        (`window.out_height_px`, `window.out_width_px`, 3) uint8.
    """
    part = _part(picture, window, PADDING_LEVEL)
    method = cv2.INTER_AREA if window.scale < 1 else cv2.INTER_LINEAR
    return np.asarray(_resized(part, window, method), dtype=np.uint8)


def cut_map(values: npt.NDArray[Any], window: Window, fill: float) -> npt.NDArray[Any]:
    """Crops and resizes an (H, W) map, such as depth or label ids, by nearest neighbour.

    Args:
        values: (H, W) map of any dtype.
        window: the part to crop, and the size after resizing.
        fill: value of cells beyond the map.

    Returns:
        (`window.out_height_px`, `window.out_width_px`) map of the same dtype.
    """
    return _resized(_part(values, window, fill), window, cv2.INTER_NEAREST_EXACT)


def cut_box(box_px: BoxPx, window: Window) -> BoxPx:
    """Converts a box from edge pixels of the picture to edge pixels of the window's output; the result is not
    clipped.

    Args:
        box_px: left, top, right and bottom; edge pixels count from 0 at the picture's left or upper border.
        window: the part to crop, and the size after resizing.
    """
    left, top, right, bottom = box_px
    return (
        (left - window.left_px) * window.scale_x,
        (top - window.top_px) * window.scale_y,
        (right - window.left_px) * window.scale_x,
        (bottom - window.top_px) * window.scale_y,
    )


def flip_box(box_px: BoxPx, width_px: int) -> BoxPx:
    """Returns a box (left, top, right, bottom) that is mirrored left to right with its picture.

    Args:
        box_px: the box in edge pixels, which count from 0 at the picture's left or upper border.
        width_px: width of the picture.
    """
    left, top, right, bottom = box_px
    return (width_px - right, top, width_px - left, bottom)


def clipped(box_px: BoxPx, frame_px: BoxPx) -> BoxPx:
    """Returns the intersection of two boxes (left, top, right, bottom).

    For boxes that do not intersect, the result has a right side left of its left side, or a bottom above its top.

    Args:
        box_px: the first box.
        frame_px: the second box, such as the borders of a picture, in the same pixels.
    """
    return (
        max(box_px[0], frame_px[0]),
        max(box_px[1], frame_px[1]),
        min(box_px[2], frame_px[2]),
        min(box_px[3], frame_px[3]),
    )


def box_area(box_px: BoxPx) -> float:
    """Returns the area of a box in square pixels; 0 if right is left of left, or bottom above top.

    Args:
        box_px: left, top, right and bottom.
    """
    left, top, right, bottom = box_px
    return max(0.0, right - left) * max(0.0, bottom - top)


def share_in_frame(box_px: BoxPx, frame_px: BoxPx) -> float:
    """Returns the share, 0..1, of a box's area that lies inside another box; 0 for a box without area.

    Args:
        box_px: left, top, right and bottom of the box.
        frame_px: the other box, such as the borders of a picture, in the same pixels.
    """
    whole = box_area(box_px)
    return box_area(clipped(box_px, frame_px)) / whole if whole > 0 else 0.0


def _part(array: npt.NDArray[Any], window: Window, fill: float) -> npt.NDArray[Any]:
    left, top = window.left_px, window.top_px
    right, bottom = left + window.width_px, top + window.height_px
    inner = array[max(top, 0) : max(bottom, 0), max(left, 0) : max(right, 0)]
    if inner.shape[:2] == (window.height_px, window.width_px):
        return np.ascontiguousarray(inner)
    part = np.full((window.height_px, window.width_px, *array.shape[2:]), fill, dtype=array.dtype)
    y, x = max(0, -top), max(0, -left)
    part[y : y + inner.shape[0], x : x + inner.shape[1]] = inner
    return part


def _resized(part: npt.NDArray[Any], window: Window, method: int) -> npt.NDArray[Any]:
    if part.shape[:2] == (window.out_height_px, window.out_width_px):
        return part
    return np.asarray(cv2.resize(part, (window.out_width_px, window.out_height_px), interpolation=method))
