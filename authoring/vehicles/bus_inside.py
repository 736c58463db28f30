"""The inside of a bus, as seen through its panes: riders, seats, rails and the panes of the far side."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from authoring.vehicles.panes import Pane, Picture, write_panes
from gear.values.rng import derive_rng

__all__ = ["BAYS", "DOORS", "DRIVER", "REAR", "SCREEN", "write_bus_inside"]

_SIZE = (512, 512)
_DARK, _CEILING, _FLOOR = (30, 32, 34), (58, 60, 61), (24, 25, 26)
_SEAT, _SEAT_FAR, _RAIL = (30, 44, 84), (36, 42, 60), (176, 142, 36)
_COATS = ((66, 60, 54), (92, 40, 40), (40, 58, 78), (96, 96, 92), (52, 70, 52), (34, 34, 38))
_SKINS = ((150, 112, 90), (112, 80, 62), (84, 60, 46), (164, 124, 102))
_HAIRS = ((34, 28, 24), (58, 42, 30), (104, 84, 56), (110, 108, 106))


BAYS = tuple(Pane(128 * k, 0, 128, 128, _SIZE) for k in range(4))
SCREEN = Pane(0, 128, 256, 192, _SIZE)
REAR = Pane(256, 128, 256, 128, _SIZE)
DOORS = (Pane(256, 256, 128, 256, _SIZE), Pane(384, 256, 128, 256, _SIZE))
DRIVER = Pane(0, 320, 128, 192, _SIZE)


def write_bus_inside(path: Path) -> None:
    """Draws the inside that is visible through all panes of a bus."""
    rng = derive_rng(0, "authoring", "bus windows")
    pictures = [(pane, _bay(pane, k, rng)) for k, pane in enumerate(BAYS)]
    pictures += [(pane, _door(pane, rng, k)) for k, pane in enumerate(DOORS)]
    pictures += [(SCREEN, _screen(rng)), (REAR, _rear(rng)), (DRIVER, _driver(rng))]
    write_panes(path, _DARK, pictures)


def _bay(pane: Pane, kind: int, rng: np.random.Generator) -> Picture:
    """Draws one of the panes of the side, 1.4 m by 1.3 m: two rows of seats on either side of the aisle."""
    picture = Picture(pane, _DARK, 1.36 / 1.32)
    picture.rect(-0.1, -0.1, 1.1, 0.07, _CEILING)
    picture.rect(-0.1, 0.02, 1.1, 0.045, (150, 150, 142))
    picture.street(-0.1, 0.12, 1.1, 0.66)
    post = (0.35, 0.8, 0.1, 0.6)[kind]
    picture.rect(post, 0.1, post + 0.06, 0.68, _DARK)
    for x in (0.12, 0.66):
        picture.rect(x, 0.52, x + 0.3, 1.1, _SEAT_FAR, 0.2)
    if kind in (1, 3):
        _rider(picture, 0.2 + 0.5 * (kind == 3), 0.30, 0.34, rng)
    picture.rect(-0.1, 0.135, 1.1, 0.155, _RAIL)
    pole = (0.52, 0.05, 0.93, 0.46)[kind]
    picture.rect(pole, 0.05, pole + 0.026, 1.1, _RAIL)
    for x, taken in ((0.0, kind == 0), (0.54, kind in (0, 2))):
        if taken:
            _rider(picture, x + 0.2, 0.36, 0.44, rng)
        picture.rect(x, 0.60, x + 0.34, 1.2, _SEAT, 0.16)
        picture.rect(x + 0.05, 0.57, x + 0.29, 0.64, (24, 34, 64), 0.1)
    return picture


def _door(pane: Pane, rng: np.random.Generator, kind: int) -> Picture:
    """Draws a leaf of a door, 0.6 m by 2 m: step, pole, the far side."""
    picture = Picture(pane, _DARK, 0.6 / 1.96)
    picture.rect(-0.1, -0.1, 1.1, 0.06, _CEILING)
    picture.street(-0.1, 0.10, 1.1, 0.46)
    if kind:
        _rider(picture, 0.48, 0.22, 0.26, rng, 0.0)
        picture.rect(0.26, 0.50, 0.72, 1.1, (38, 40, 48))
    else:
        picture.rect(0.1, 0.52, 0.9, 0.86, _SEAT_FAR, 0.1)
    picture.rect(-0.1, 0.88, 1.1, 1.1, _FLOOR)
    picture.rect(-0.1, 0.875, 1.1, 0.89, _RAIL)
    picture.rect(0.78 - 0.6 * kind, 0.04, 0.85 - 0.6 * kind, 0.9, _RAIL)
    return picture


def _screen(rng: np.random.Generator) -> Picture:
    """Draws the windscreen, 2.5 m by 1.55 m, as seen from before the bus: the driver sits on the right of the
    picture.
    """
    picture = Picture(SCREEN, _DARK, 2.45 / 1.55)
    _aisle(picture, 0.46, 0.44)
    for k, x in enumerate((0.30, 0.60)):
        _rider(picture, x, 0.40 + 0.04 * k, 0.22, rng, 0.0)
    for x in (0.24, 0.68):
        picture.rect(x, 0.1, x + 0.012, 0.8, _RAIL)
    picture.rect(0.70, 0.30, 0.705, 0.8, (70, 72, 74))
    _rider(picture, 0.80, 0.36, 0.34, rng, 0.0)
    picture.rect(-0.1, 0.80, 1.1, 1.1, (20, 21, 22))
    picture.oval(0.80, 0.80, 0.24, (16, 16, 17), 1.4, 0.022)
    picture.rect(-0.1, -0.1, 1.1, 0.15, (14, 14, 15))
    return picture


def _rear(rng: np.random.Generator) -> Picture:
    """Draws the rear window, 2.2 m by 1 m, with the riders of the last row from behind."""
    picture = Picture(REAR, _DARK, 2.2 / 1.02)
    _aisle(picture, 0.5, 0.46)
    for x in (0.22, 0.66):
        _rider(picture, x, 0.40, 0.44, rng, 0.0)
    for x in (0.04, 0.25, 0.55, 0.76):
        picture.rect(x, 0.66, x + 0.19, 1.2, _SEAT, 0.12)
    return picture


def _aisle(picture: Picture, x: float, y: float) -> None:
    """Draws the inside along the bus: the panes of both sides run towards (x, y), the pane at the other end."""
    near, far = (0.16, 0.70), (y - 0.10, y + 0.10)
    for side, end in ((0.0, x - 0.12), (1.0, x + 0.12)):
        for k in range(4):
            a, b = 1 - 0.72**k, 1 - 0.72 ** (k + 0.8)
            xs = [side + (end - side) * s for s in (a, b)]
            tops = [near[0] + (far[0] - near[0]) * s for s in (a, b)]
            ends = [near[1] + (far[1] - near[1]) * s for s in (a, b)]
            shade = 118 - 8 * k
            quad = [(xs[0], tops[0]), (xs[1], tops[1]), (xs[1], ends[1]), (xs[0], ends[0])]
            picture.poly(quad, (shade, shade + 5, shade + 9))
    picture.poly([(0.3, -0.1), (0.7, -0.1), (x + 0.06, far[0] - 0.02), (x - 0.06, far[0] - 0.02)], _CEILING)
    picture.rect(x - 0.09, far[0], x + 0.09, far[1], (116, 122, 126))


def _driver(rng: np.random.Generator) -> Picture:
    """Draws the window of the driver, 0.9 m by 1.3 m, as seen from the left: the bus's front is on the left."""
    picture = Picture(DRIVER, _DARK, 0.9 / 1.32)
    picture.street(-0.1, 0.12, 0.24, 0.62)
    picture.rect(0.62, -0.1, 1.1, 1.1, (44, 46, 48))
    _rider(picture, 0.46, 0.30, 0.36, rng, -0.25)
    picture.rect(0.34, 0.62, 0.62, 1.1, _SEAT, 0.1)
    picture.poly([(0.02, 0.78), (0.16, 0.66), (0.2, 0.68), (0.06, 0.82)], (14, 14, 15))
    picture.rect(-0.1, 0.84, 0.3, 1.1, _FLOOR)
    return picture


def _rider(picture: Picture, x: float, top: float, high: float, rng: np.random.Generator, facing: float = 0.25) -> None:
    """Draws head and shoulders; `high` is the height from the crown down to the chest, and `facing` shifts the face."""
    coat, skin, hair = (colours[rng.integers(len(colours))] for colours in (_COATS, _SKINS, _HAIRS))
    width = 0.62 * high / picture.wide
    picture.rect(x - width / 2, top + 0.42 * high, x + width / 2, top + 1.3 * high, coat, 0.3)
    picture.oval(x, top + 0.22 * high, 0.42 * high, hair, 0.8)
    picture.oval(x + facing * 0.3 * width, top + 0.29 * high, 0.36 * high, skin, 0.72)
