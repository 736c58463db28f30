"""The inside of a car, as seen through its panes: seats, headrests, wheel, and the panes of the other sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from authoring.mesh import Mesh, merge
from authoring.vehicles.panes import Pane, Picture, pieces, write_panes
from authoring.vehicles.parts import Parts
from authoring.vehicles.shell import Shell

__all__ = ["look_inside", "write_car_inside"]

_SIZE = (128, 128)
_SIDE, _SCREEN, _REAR = Pane(0, 0, 128, 64, _SIZE), Pane(0, 64, 64, 64, _SIZE), Pane(64, 64, 64, 64, _SIZE)
_DARK, _LINING, _SEAT, _WHEEL = (19, 20, 22), (34, 35, 37), (30, 31, 34), (9, 9, 10)
_LIGHT = 0.66
"""Brightness of the street through two panes; panes of cars are tinted, so it is darker than in a bus."""


def look_inside(parts: Parts, cabin: Shell) -> None:
    """Puts pictures of the inside on the glass of a car that `build_car` made."""
    parts.meshes["glass"] = [_dressed(half, cabin.corners) for half in parts.meshes["glass"]]


def write_car_inside(path: Path) -> None:
    """Draws the inside that is visible through the panes of cars, vans and lorries."""
    write_panes(path, _DARK, [(_SIDE, _side()), (_SCREEN, _screen()), (_REAR, _rear())])


def _dressed(mesh: Mesh, corners: tuple[float, float]) -> Mesh:
    """Returns the glass of one side, left or right, with a picture of the inside.

    Args:
        mesh: the glass, with the belt's parameters for texture coordinates, as `Sheet.part` makes it.
        corners: belt parameters of the front and rear corners: the windscreen lies before, the rear window behind.
    """
    group = np.searchsorted(corners, mesh.uvs[mesh.faces, 0].mean(axis=1))
    dressed = []
    for k, piece in pieces(mesh, group):
        low, high = piece.bounds
        x, y, z = piece.vertices.T
        up = (z - low[2]) / (high[2] - low[2])
        across = y / np.abs(y).max() / 2
        along = (0.5 + across, (x - low[0]) / (high[0] - low[0]), 0.5 - across)[k]
        dressed.append((_SCREEN, _SIDE, _REAR)[k].dress(piece, along, up))
    return merge(dressed)


def _side() -> Picture:
    """Draws the side windows, 2.2 m by 0.45 m, the front on the right."""
    picture = Picture(_SIDE, _DARK, 4.5)
    picture.rect(-0.1, -0.1, 1.1, 0.1, _LINING)
    picture.street(0.04, 0.14, 0.36, 0.78, 0.8 * _LIGHT)
    picture.street(0.42, 0.14, 0.66, 0.78, _LIGHT)
    picture.street(0.70, 0.14, 1.1, 0.78, _LIGHT)
    for x, top in ((0.16, 0.36), (0.30, 0.40), (0.56, 0.28)):
        _seat(picture, x, top, 0.085)
    picture.poly([(0.78, 0.58), (0.80, 0.56), (0.845, 0.92), (0.825, 0.94)], _WHEEL)
    picture.poly([(0.84, 0.80), (1.1, 0.72), (1.1, 1.1), (0.84, 1.1)], _WHEEL)
    return picture


def _screen() -> Picture:
    """Draws the windscreen, 1.4 m by 0.55 m, as seen from before the car: the wheel is on the right."""
    picture = Picture(_SCREEN, _DARK, 2.6)
    picture.rect(-0.1, -0.1, 1.1, 0.08, _LINING)
    picture.street(0.32, 0.24, 0.68, 0.58, 0.8 * _LIGHT)
    for edge, inner in ((0.0, 0.09), (1.0, 0.91)):
        picture.poly([(edge, 0.16), (inner, 0.2), (inner, 0.62), (edge, 0.72)], (62, 66, 69))
    for x in (0.24, 0.76):
        _seat(picture, x, 0.28, 0.15)
    picture.rect(0.44, 0.06, 0.56, 0.2, _WHEEL, 0.1)
    picture.rect(-0.1, 0.78, 1.1, 1.1, (13, 13, 14))
    picture.oval(0.76, 0.84, 0.42, _WHEEL, 1.5, 0.035)
    return picture


def _rear() -> Picture:
    """Draws the rear window, 1.2 m by 0.4 m: headrests in front of the bright windscreen."""
    picture = Picture(_REAR, _DARK, 3.0)
    picture.rect(-0.1, -0.1, 1.1, 0.1, _LINING)
    picture.street(0.16, 0.22, 0.84, 0.66, 0.7 * _LIGHT)
    for edge, inner in ((0.0, 0.09), (1.0, 0.91)):
        picture.poly([(edge, 0.2), (inner, 0.24), (inner, 0.62), (edge, 0.7)], (52, 55, 58))
    for x in (0.34, 0.66):
        _seat(picture, x, 0.30, 0.10)
    for x in (0.22, 0.5, 0.78):
        _seat(picture, x, 0.48, 0.15)
    picture.rect(-0.1, 0.84, 1.1, 1.1, (13, 13, 14))
    return picture


def _seat(picture: Picture, x: float, top: float, width: float) -> None:
    """Draws a headrest and the back of the seat below it."""
    picture.rect(x - 0.36 * width, top, x + 0.36 * width, top + 0.22, _SEAT, 0.3)
    picture.rect(x - width / 2, top + 0.25, x + width / 2, 1.3, _SEAT, 0.25)
