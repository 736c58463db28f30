"""Moving pixels: mirrored samples, and windows of samples at another size."""

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
"""Grey of what a window shows beyond the picture."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Part of a picture, shown at a size of its own.

    Attributes:
        left_px, top_px, width_px, height_px: of the part, in whole edge pixels of the picture; it may exceed the
            picture, and what lies beyond is padding.
        out_width_px, out_height_px: size that it is shown at.
    """

    left_px: int
    top_px: int
    width_px: int
    height_px: int
    out_width_px: int
    out_height_px: int

    @property
    def scale_x(self) -> float:
        """Pixels shown for each of the picture's, along a row."""
        return self.out_width_px / self.width_px

    @property
    def scale_y(self) -> float:
        """The same along a column."""
        return self.out_height_px / self.height_px

    @property
    def scale(self) -> float:
        """Their geometric mean."""
        return math.sqrt(self.scale_x * self.scale_y)


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry(Generic[SampleT]):
    """How one task's samples are moved. No function changes the sample that it is given.

    Attributes:
        flip: gives the sample mirrored, left to right.
        cut: gives the part of the sample that a window shows.
        is_centred: whether a window must share the picture's centre, because the ground truth needs its principal point
            there.
        shrink: gives the sample that a camera with fewer pixels would take; its window is the whole picture. None where
            `cut` does that.
        cut_depth: gives the sample with its depth pasted into the picture (CutDepth); None for tasks without depth.
    """

    flip: Callable[[SampleT], SampleT]
    cut: Callable[[SampleT, Window], SampleT]
    is_centred: bool = False
    shrink: Callable[[SampleT, Window], SampleT] | None = None
    cut_depth: Callable[[SampleT, np.random.Generator], SampleT] | None = None


def whole_window(size_px: tuple[int, int], share: float) -> Window:
    """The whole of a picture of that height and width, shown at a share of its size."""
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
    """A window somewhere in (or, where it is larger, around) a picture.

    Args:
        size_px: height and width of the picture.
        out_px: height and width to show the window at.
        scale: shown pixels for each of the picture's.
        rng: draws the place.
        is_centred: whether it must share the picture's middle.
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
    """The nearest whole number above 0 that is as even as another one."""
    return max(2 * round((value - like % 2) / 2) + like % 2, 2 - like % 2)


def _between(room_px: int, rng: np.random.Generator) -> int:
    return int(rng.integers(min(room_px, 0), max(room_px, 0) + 1))


def flip_array(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """(H, W, ...) with its columns the other way round."""
    return np.ascontiguousarray(array[:, ::-1])


def cut_picture(picture: UInt8Image, window: Window) -> UInt8Image:
    """What the window shows of an (H, W, 3) picture: averaged where it shrinks, bilinear where it grows."""
    part = _part(picture, window, PADDING_LEVEL)
    method = cv2.INTER_AREA if window.scale < 1 else cv2.INTER_LINEAR
    return np.asarray(_resized(part, window, method), dtype=np.uint8)


def cut_map(values: npt.NDArray[Any], window: Window, fill: float) -> npt.NDArray[Any]:
    """What the window shows of an (H, W) map, each pixel one of the map's own; `fill` beyond it."""
    return _resized(_part(values, window, fill), window, cv2.INTER_NEAREST_EXACT)


def cut_box(box_px: BoxPx, window: Window) -> BoxPx:
    """A box in edge pixels of the picture, in edge pixels of what the window shows; not clipped."""
    left, top, right, bottom = box_px
    return (
        (left - window.left_px) * window.scale_x,
        (top - window.top_px) * window.scale_y,
        (right - window.left_px) * window.scale_x,
        (bottom - window.top_px) * window.scale_y,
    )


def flip_box(box_px: BoxPx, width_px: int) -> BoxPx:
    """A box in edge pixels, mirrored."""
    left, top, right, bottom = box_px
    return (width_px - right, top, width_px - left, bottom)


def clipped(box_px: BoxPx, frame_px: BoxPx) -> BoxPx:
    """The part of a box inside another one; where they do not meet, its right side lies left of its left one, or its
    bottom above its top."""
    return (
        max(box_px[0], frame_px[0]),
        max(box_px[1], frame_px[1]),
        min(box_px[2], frame_px[2]),
        min(box_px[3], frame_px[3]),
    )


def box_area(box_px: BoxPx) -> float:
    """Square pixels of a box; 0 for one whose sides are in the wrong order."""
    left, top, right, bottom = box_px
    return max(0.0, right - left) * max(0.0, bottom - top)


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
