"""Capitals and digits of number plates and signs, as strokes: no font file, and the same pixels on every machine."""

from __future__ import annotations

import numpy as np
from PIL import Image

from authoring.mesh import Floats

__all__ = ["lettering"]

_ACROSS, _DOWN = 6, 8
_HIGH_PX = 160
_WIDE, _NARROW, _GAP, _SPACE, _STROKE = 0.62, 0.30, 0.19, 0.30, 0.155
"""Widths of a letter's box, of an I's, between letters, of a space, and of the stroke: shares of a capital's height."""

# Strokes of digit pairs: right 0 to 6, down 0 to 8. "~" rounds a stroke's corners, "@" does so and closes it.
_STROKES = {
    "A": "08 30 68,25 45", "B": "00 08,~00 60 64 04,~04 64 68 08", "C": "~62 60 00 08 68 66", "D": "00 08,~00 60 68 08",
    "E": "60 00 08 68,04 54", "F": "60 00 08,04 54", "G": "~62 60 00 08 68 64 34", "H": "00 08,60 68,04 64",
    "I": "30 38", "J": "~60 68 08 06", "K": "00 08,60 05,24 68", "L": "00 08 68", "M": "08 00 35 60 68",
    "N": "08 00 68 60", "O": "@00 60 68 08", "P": "00 08,~00 60 65 05", "R": "00 08,~00 60 64 04,34 68",
    "S": "~62 60 00 04 64 68 08 06", "T": "00 60,30 38", "U": "~00 08 68 60", "V": "00 38 60", "W": "00 18 33 58 60",
    "X": "00 68,60 08", "Y": "00 34 60,34 38", "Z": "00 60 08 68", "0": "@00 60 68 08", "1": "13 30 38",
    "2": "~02 00 60 64 08,08 68", "3": "~01 00 60 64 24,~24 64 68 08 07", "4": "40 06 66,44 48",
    "5": "60 10 04,~04 63 68 08 07", "6": "~61 60 00 08 68 64 04", "7": "00 60 28", "8": "@00 60 64 04,@04 64 68 08",
    "9": "~07 08 68 60 00 04 64",
}  # fmt: skip


def lettering(text: str, width: int, height: int) -> Image.Image:
    """A mask of `width` × `height` pixels (mode L, white on black) that the line of text fills from edge to edge."""
    wide = [_SPACE if c == " " else (_NARROW if c in "I1" else _WIDE) for c in text]
    length = sum(wide) + _GAP * (len(text) - 1)
    mask = np.zeros((_HIGH_PX, round(length * _HIGH_PX)))
    at = 0.0
    for letter, box in zip(text, wide, strict=True):
        if letter != " ":
            _draw(mask, letter, at, box)
        at += box + _GAP
    picture = Image.fromarray(np.rint(mask * 255).astype(np.uint8))
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def _draw(mask: Floats, letter: str, left: float, wide: float) -> None:
    """Draws a letter into the mask's columns from `left`; lengths are shares of the mask's height."""
    first, last = max(0, int(left * _HIGH_PX) - 2), int((left + wide) * _HIGH_PX) + 3
    part = mask[:, first:last]
    x, y = np.meshgrid((np.arange(part.shape[1]) + first + 0.5) / _HIGH_PX, (np.arange(_HIGH_PX) + 0.5) / _HIGH_PX)
    half = _STROKE / 2
    strokes = [_points(stroke) for stroke in _STROKES[letter].split(",")]
    # A letter narrower than the grid, such as an I, fills its box all the same.
    low, high = min(p[:, 0].min() for p in strokes), max(p[:, 0].max() for p in strokes)
    low, high = (0.0, float(_ACROSS)) if low == high else (low, high)
    for points in strokes:
        px = left + half + (points[:, 0] - low) / (high - low) * (wide - _STROKE)
        py = half + points[:, 1] / _DOWN * (1 - _STROKE)
        for k in range(len(px) - 1):
            dx, dy = px[k + 1] - px[k], py[k + 1] - py[k]
            share = np.clip(((x - px[k]) * dx + (y - py[k]) * dy) / (dx * dx + dy * dy), 0, 1)
            distance = np.hypot(x - px[k] - share * dx, y - py[k] - share * dy)
            np.maximum(part, np.clip((half - distance) * _HIGH_PX + 0.5, 0, 1), out=part)


def _points(stroke: str) -> Floats:
    """(N, 2) points of a stroke on the grid, right and down."""
    points = np.array([(int(pair[0]), int(pair[1])) for pair in stroke.lstrip("~@").split()], dtype=np.float64)
    if stroke[0] not in "~@":
        return points
    if stroke[0] == "@":
        points = np.concatenate([[(points[0] + points[1]) / 2], points[1:], points[:1], [(points[0] + points[1]) / 2]])
    bends = [points[:1]]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        start, end = _towards(corner, before), _towards(corner, after)
        t = np.linspace(0, 1, 9)[:, None]
        bends.append((1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end)
    return np.concatenate([*bends, points[-1:]])


def _towards(corner: Floats, other: Floats, radius: float = 1.9) -> Floats:
    """Where the bend at a corner begins: at most half way to the next point."""
    step = other - corner
    out: Floats = corner + step * min(0.5, radius / float(np.linalg.norm(step)))
    return out
