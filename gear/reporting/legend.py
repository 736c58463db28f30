"""Draws legends as pictures: names beside their colours, or a colour bar with ticks."""

from __future__ import annotations

import cv2
import numpy as np

from gear.contracts.legends import ColourBar, ColourNames, Legend, Rgb
from gear.values.frames import UInt8Image

INK, PAPER = (235, 235, 235), (24, 24, 24)
FONT, FONT_SCALE = cv2.FONT_HERSHEY_SIMPLEX, 0.4
LINE_PX, MARGIN_PX, SWATCH_PX, GAP_PX = 20, 6, 12, 14
DARK, FRAME = 64, (110, 110, 110)
"""A swatch whose channels are all below `DARK` gets a frame of the colour `FRAME`, as it is as dark as the strip."""

BAR_PX = (10, 360)
"""Height and largest width of a colour bar in pixels."""


def draw_legend(legend: Legend, width_px: int) -> UInt8Image:
    """Draws a legend as a dark strip, in the style of the captions of a contact sheet.

    Args:
        legend: names and colours, or a colour bar.
        width_px: width of the strip.

    Returns:
        (H, width_px, 3) uint8 RGB; H grows with the number of lines that the names need.
    """
    return _bar(legend, width_px) if isinstance(legend, ColourBar) else _names(legend, width_px)


def _names(legend: ColourNames, width_px: int) -> UInt8Image:
    places: list[tuple[int, int, str, Rgb]] = []
    left, line = MARGIN_PX, 0
    for name, rgb in legend.entries:
        needed = SWATCH_PX + 4 + _text_width(name)
        if left > MARGIN_PX and left + needed > width_px - MARGIN_PX:
            left, line = MARGIN_PX, line + 1
        places.append((left, line, name, rgb))
        left += needed + GAP_PX
    strip = _paper((line + 1) * LINE_PX, width_px)
    for left, line, name, rgb in places:
        top = line * LINE_PX + (LINE_PX - SWATCH_PX) // 2
        corner = (left + SWATCH_PX - 1, top + SWATCH_PX - 1)
        cv2.rectangle(strip, (left, top), corner, rgb, cv2.FILLED)
        if max(rgb) < DARK:
            cv2.rectangle(strip, (left, top), corner, FRAME, 1)
        _write(strip, name, left + SWATCH_PX + 4, line)
    return strip


def _bar(legend: ColourBar, width_px: int) -> UInt8Image:
    strip = _paper(2 * LINE_PX, width_px)
    _write(strip, legend.quantity, MARGIN_PX, 0)
    left = MARGIN_PX + _text_width(legend.quantity) + GAP_PX
    height, length = BAR_PX[0], max(2, min(BAR_PX[1], width_px - left - 2 * MARGIN_PX))
    colours = np.array(legend.colours, dtype=np.float64)
    at = np.linspace(0, len(colours) - 1, length)
    row = np.stack([np.interp(at, np.arange(len(colours)), colours[:, c]) for c in range(3)], axis=-1)
    top = (LINE_PX - height) // 2
    shown = strip[top : top + height, left : left + length]
    shown[:] = np.rint(row).astype(np.uint8)[: shown.shape[1]]
    for position, text in legend.ticks:
        x = left + round(position * (length - 1))
        cv2.line(strip, (x, top + height), (x, top + height + 3), INK, 1)
        _write(strip, text, x - _text_width(text) // 2, 1)
    return strip


def _paper(height_px: int, width_px: int) -> UInt8Image:
    return np.full((height_px, width_px, 3), PAPER, np.uint8)


def _text_width(text: str) -> int:
    return int(cv2.getTextSize(text, FONT, FONT_SCALE, 1)[0][0])


def _write(strip: UInt8Image, text: str, left_px: int, line: int) -> None:
    cv2.putText(strip, text, (left_px, line * LINE_PX + 14), FONT, FONT_SCALE, INK, 1, cv2.LINE_AA)
