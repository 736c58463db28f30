"""A canvas for drawing maps, with north at the top. It is drawn at twice its size, so edges are smooth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image

Colour = tuple[int, int, int]
Anchor = Literal["left", "middle", "right"]
Mask = npt.NDArray[np.uint8]
Points = npt.NDArray[np.float64]

OVERSAMPLING = 2
SHIFT = 4
"""Number of fractional bits of OpenCV positions: positions are in sixteenths of a pixel."""

FONT = cv2.FONT_HERSHEY_SIMPLEX
FONT_HEIGHT_PX = 22.0
"""Height in pixels of a capital letter of the font at scale 1."""

HAS_STROKES = int(cv2.__version__.partition(".")[0]) < 5
"""True for OpenCV 4, where the line width of letters must grow with their size; in OpenCV 5 it is the font weight."""


class Canvas:
    """A picture on which a map of the world is drawn.

    Positions are (N, 2) arrays. Names that end in `_m` are metres in the world; names that end in `_px` are pixels of
    the finished picture, x to the right and y down.
    """

    def __init__(
        self,
        size_px: tuple[int, int],
        paper: Colour,
        *,
        px_per_m: float = 1.0,
        origin_px: tuple[float, float] = (0.0, 0.0),
        box_px: tuple[float, float, float, float] | None = None,
    ) -> None:
        """Makes an empty picture.

        Args:
            size_px: width and height of the finished picture.
            paper: colour of the background.
            px_per_m: scale of the map.
            origin_px: position of the world's (0, 0) in the picture.
            box_px: left, top, right and bottom of the part of the picture that the map covers; None means the whole
                picture.
        """
        self.size_px = size_px
        self.box_px = box_px or (0.0, 0.0, float(size_px[0]), float(size_px[1]))
        self.px_per_m = px_per_m
        self._origin_px = np.array(origin_px)
        self._pixels = np.full((size_px[1] * OVERSAMPLING, size_px[0] * OVERSAMPLING, 3), paper, np.uint8)

    def picture(self) -> UInt8Image:
        """Returns the finished picture, (H, W, 3) uint8 RGB."""
        return np.asarray(cv2.resize(self._pixels, self.size_px, interpolation=cv2.INTER_AREA), dtype=np.uint8)

    def to_px(self, points_m: npt.ArrayLike) -> Points:
        """Converts positions in the world to pixels of the canvas.

        Args:
            points_m: (N, 2 or more) positions in metres; columns after x and y are ignored.

        Returns:
            (N, 2) pixels, x to the right and y down.
        """
        points = np.atleast_2d(np.asarray(points_m, dtype=np.float64))[:, :2]
        return np.asarray(self._origin_px + points * (self.px_per_m, -self.px_per_m))

    def fill(self, outline_px: npt.ArrayLike, colour: Colour, opacity: float = 1.0) -> None:
        """Fills the polygon with the (N, 2) corners `outline_px`.

        Args:
            outline_px: corners in pixels of the finished picture.
            colour: RGB, 0..255.
            opacity: 0 (invisible) to 1 (opaque).
        """
        fixed = _fixed(outline_px)
        if opacity >= 1.0:
            cv2.fillPoly(self._pixels, [fixed], colour, cv2.LINE_AA, SHIFT)
            return
        mask = self.mask()
        cv2.fillPoly(mask, [fixed], 255, cv2.LINE_AA, SHIFT)
        self.blend(mask, colour, opacity)

    def line(
        self, points_px: npt.ArrayLike, colour: Colour, width_px: float, *, closed: bool = False, opacity: float = 1.0
    ) -> None:
        """Draws a line of `width_px` through the (N, 2) points; `closed` joins the last point to the first.

        Args:
            points_px: points in pixels of the finished picture.
            colour: RGB, 0..255.
            width_px: width of the line.
            closed: whether the last point is joined to the first.
            opacity: 0 (invisible) to 1 (opaque).
        """
        width = max(1, round(width_px * OVERSAMPLING))
        if opacity >= 1.0:
            cv2.polylines(self._pixels, [_fixed(points_px)], closed, colour, width, cv2.LINE_AA, SHIFT)
            return
        mask = self.mask()
        cv2.polylines(mask, [_fixed(points_px)], closed, 255, width, cv2.LINE_AA, SHIFT)
        self.blend(mask, colour, opacity)

    def dashes(
        self, points_px: npt.ArrayLike, colour: Colour, width_px: float, *, dash_px: float, gap_px: float,
        closed: bool = False,
    ) -> None:  # fmt: skip
        """Draws a dashed line through the (N, 2) points; `closed` joins the last point to the first.

        Args:
            points_px: points in pixels of the finished picture.
            colour: RGB, 0..255.
            width_px: width of the line.
            dash_px, gap_px: lengths of dashes and gaps.
            closed: whether the last point is joined to the first.
        """
        points = np.asarray(points_px, dtype=np.float64)
        if closed:
            points = np.concatenate([points, points[:1]])
        starts = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        for start in np.arange(0.0, starts[-1], dash_px + gap_px):
            end = min(start + dash_px, float(starts[-1]))
            along = np.concatenate([[start], starts[(starts > start) & (starts < end)], [end]])
            piece = np.stack([np.interp(along, starts, points[:, axis]) for axis in (0, 1)], axis=1)
            self.line(piece, colour, width_px)

    def dot(self, centre_px: npt.ArrayLike, radius_px: float, colour: Colour) -> None:
        """Draws a filled disc around a point.

        Args:
            centre_px: (x, y) in pixels of the finished picture.
            radius_px: radius of the disc.
            colour: RGB, 0..255.
        """
        (x, y), one = _fixed(np.atleast_2d(centre_px))[0, 0], OVERSAMPLING << SHIFT
        cv2.circle(self._pixels, (int(x), int(y)), round(radius_px * one), colour, -1, cv2.LINE_AA, SHIFT)

    def mask(self) -> Mask:
        """Returns an empty mask; `fill_triangles` adds shapes to a mask and `blend` draws the mask."""
        return np.zeros(self._pixels.shape[:2], np.uint8)

    def fill_triangles(self, mask: Mask, triangles_m: Points) -> None:
        """Sets the pixels of a mask inside triangles to 255; the mask is changed in place.

        Args:
            mask: (H, W) mask of the size of the canvas.
            triangles_m: (N, 3, 2) corners in metres in the world.
        """
        for triangle in _fixed_many(self.to_px(triangles_m.reshape(-1, 2))).reshape(-1, 3, 2):
            cv2.fillConvexPoly(mask, triangle, 255, cv2.LINE_8, SHIFT)

    def blend(self, mask: Mask, colour: Colour, opacity: float = 1.0) -> None:
        """Mixes a colour into the pixels of a mask; the weight of the colour is the mask's value (0..255) times
        the opacity (0..1).
        """
        x, y, width, height = cv2.boundingRect(mask)
        if not width:
            return
        part = self._pixels[y : y + height, x : x + width]
        weight = mask[y : y + height, x : x + width, None].astype(np.uint16) * round(opacity * 256) // 255
        mixed = part.astype(np.uint16) * (256 - weight) + np.array(colour, np.uint16) * weight
        part[:] = mixed >> 8

    def outline(self, mask: Mask, colour: Colour, width_px: float) -> None:
        """Draws the outlines of all regions of a mask.

        Args:
            mask: (H, W) bool mask.
            colour: RGB, 0..255.
            width_px: width of the outlines.
        """
        rings, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(self._pixels, rings, -1, colour, max(1, round(width_px * OVERSAMPLING)), cv2.LINE_AA)

    def shift_down_right(self, mask: Mask, length_px: float) -> Mask:
        """Returns a mask moved down and to the right by `length_px` in each direction; used as a shadow."""
        step = length_px * OVERSAMPLING
        moved = cv2.warpAffine(mask, np.array([[1.0, 0.0, step], [0.0, 1.0, step]]), mask.shape[::-1])
        return np.asarray(moved, dtype=np.uint8)

    def clip(self, paper: Colour) -> None:
        """Fills the margins of the picture with a colour: everything outside the part that the map covers (`box_px`).

        Args:
            paper: colour of the margins.
        """
        left, top, right, bottom = (round(value * OVERSAMPLING) for value in self.box_px)
        inside = self._pixels[top:bottom, left:right].copy()
        self._pixels[:] = paper
        self._pixels[top:bottom, left:right] = inside

    def text(
        self, at_px: tuple[float, float], words: str, height_px: float, colour: Colour, *, anchor: Anchor = "left",
        bold: bool = False, halo: Colour | None = None,
    ) -> None:  # fmt: skip
        """Writes one line of text.

        Args:
            at_px: position on the baseline of the text; `anchor` says which point of the text is there.
            words: the text.
            height_px: height of a capital letter.
            colour: colour of the letters.
            anchor: the point of the text that is at `at_px`: its left end, its middle or its right end.
            bold: whether the letters are bold.
            halo: colour of an edge around the letters; None for no edge.
        """
        width_px = self.text_width_px(words, height_px, bold=bold)
        left_px = at_px[0] - width_px * {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor]
        origin = (round(left_px * OVERSAMPLING), round(at_px[1] * OVERSAMPLING))
        scale, thickness = _font(height_px, bold)
        if halo is not None:
            cv2.putText(self._pixels, words, origin, FONT, scale, halo, thickness + 4 * OVERSAMPLING, cv2.LINE_AA)
        cv2.putText(self._pixels, words, origin, FONT, scale, colour, thickness, cv2.LINE_AA)

    def text_width_px(self, words: str, height_px: float, *, bold: bool = False) -> float:
        """Returns the width of a line of text in pixels of the finished picture.

        Args:
            words: the text.
            height_px: height of the letters.
            bold: whether the text is bold.
        """
        scale, thickness = _font(height_px, bold)
        return float(cv2.getTextSize(words, FONT, scale, thickness)[0][0]) / OVERSAMPLING


def round_step_m(span_m: float, max_parts: int) -> float:
    """Returns the smallest length of 1, 2 or 5 times a power of ten that divides `span_m` into at most `max_parts`
    parts.
    """
    power = 10.0 ** math.floor(math.log10(span_m / max_parts))
    return next(power * factor for factor in (1, 2, 5, 10) if span_m / (power * factor) <= max_parts)


def rectangle(x_px: float, y_px: float, width_px: float, height_px: float) -> Points:
    """Returns the (4, 2) corners of an axis-parallel rectangle, given by its upper left corner and its size.

    Args:
        x_px, y_px: upper left corner.
        width_px, height_px: size.
    """
    return np.array([x_px, y_px]) + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * (width_px, height_px)


def _font(height_px: float, bold: bool) -> tuple[float, int]:
    scale = height_px * OVERSAMPLING / FONT_HEIGHT_PX
    if HAS_STROKES:
        return scale, max(1, round(scale * (3.0 if bold else 1.6)))
    return scale, 2 if bold else 1


def _fixed_many(points_px: Points) -> npt.NDArray[np.int32]:
    """Converts pixels to OpenCV's fixed-point positions, whose pixel centres are integers instead of halves."""
    return np.asarray(np.round((points_px * OVERSAMPLING - 0.5) * (1 << SHIFT)), dtype=np.int32)


def _fixed(points_px: npt.ArrayLike | Sequence[Points]) -> npt.NDArray[np.int32]:
    return _fixed_many(np.asarray(points_px, dtype=np.float64)).reshape(-1, 1, 2)
