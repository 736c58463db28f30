"""Textures that all vehicles share: the positions of their parts, and the drawing.

`details.png` dresses trim, in 4 × 4 cells (plastic, grilles). `lamps.png` has all lights, in 4 × 4 cells. `plates.png`
has 3 × 12 number plates: one for each vehicle, and some that all vehicles share.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from authoring.mesh import Floats, Mesh
from authoring.vehicles.lettering import lettering
from authoring.vehicles.plates import PLATES, SHARED_PLATES, draw_plate

__all__ = ["DETAILS", "LAMPS", "Cell", "cell_uvs", "flat", "plate_cells", "write_atlases"]

_SIZE, _OVER = 512, 4
_CELL = _SIZE // 4
_MARGIN = 0.06
_PLATE, _PLATE_COLUMNS = (170, 42), 3
_PLATE_MARGIN_PX = 4
_PLATES_EACH = 6


@dataclass(frozen=True)
class Cell:
    """A rectangle of a texture.

    Attributes:
        left, top, width, height: position and size as shares of the texture, from its upper left corner.
        margin: shares of width and height that stay free at each edge, so that neighbouring cells never mix in.
    """

    left: float
    top: float
    width: float
    height: float
    margin: tuple[float, float] = (_MARGIN, _MARGIN)


def _grid(names: dict[str, tuple[int, int]]) -> dict[str, Cell]:
    """Returns the cells of a grid of 4 × 4 by their names."""
    return {name: Cell(column / 4, row / 4, 1 / 4, 1 / 4) for name, (column, row) in names.items()}


_DETAILS = {
    "plastic": (0, 0), "gloss": (1, 0), "bars": (2, 0), "mesh": (3, 0),
    "silver": (1, 1), "rescue": (2, 1), "rubber": (3, 1),
    "taxi": (0, 2), "slats": (1, 2), "chequer": (2, 2), "wood": (3, 2),
    "display": (0, 3), "battenburg": (1, 3), "stripe": (2, 3), "white": (3, 3),
}  # fmt: skip
_LAMPS = {
    "head": (0, 0), "head_round": (1, 0), "head_slim": (2, 0), "fog": (3, 0),
    "tail": (0, 1), "tail_led": (1, 1), "tail_tall": (2, 1), "brake": (3, 1),
    "amber": (0, 2), "reverse": (1, 2), "tail_block": (2, 2), "blue": (3, 2),
    "drl": (0, 3), "red": (1, 3), "head_block": (2, 3), "clear": (3, 3),
}  # fmt: skip
DETAILS = _grid(_DETAILS)
LAMPS = _grid(_LAMPS)


def plate_cells(name: str) -> list[Cell]:
    """Returns the plates that the instances of a vehicle have in turn: its own, then some of the shared plates."""
    own = list(PLATES).index(name)
    shared = [len(PLATES) + (5 * own + k) % len(SHARED_PLATES) for k in range(_PLATES_EACH - 1)]
    margin = (_PLATE_MARGIN_PX / _PLATE[0], _PLATE_MARGIN_PX / _PLATE[1])
    width, height = _PLATE[0] / _SIZE, _PLATE[1] / _SIZE
    return [
        Cell(k % _PLATE_COLUMNS * width, k // _PLATE_COLUMNS * height, width, height, margin) for k in (own, *shared)
    ]


def cell_uvs(cell: Cell, unit: Floats) -> Floats:
    """Returns the texture coordinates of (N, 2) positions in a cell; positions are 0 to 1, rightwards and upwards."""
    margin = np.array(cell.margin)
    inner = margin + np.clip(unit, 0, 1) * (1 - 2 * margin)
    u = cell.left + inner[:, 0] * cell.width
    return np.stack([u, 1 - (cell.top + (1 - inner[:, 1]) * cell.height)], axis=1)


def flat(mesh: Mesh, cell: Cell) -> Mesh:
    """Returns the mesh with the colour in the middle of a cell."""
    return mesh.with_uvs(cell_uvs(cell, np.array([[0.5, 0.5]]))[0])


def write_atlases(folder: Path) -> None:
    """Draws the textures."""
    for name, image in (("details", _details()), ("plates", _plates()), ("lamps", _lamps())):
        size = (image.width // _OVER, image.height // _OVER)
        image.resize(size, Image.Resampling.LANCZOS).save(folder / f"{name}.png", optimize=True)


class _Cell:
    """A picture of one cell; coordinates are 0 to 1, rightwards and downwards, without the margin."""

    def __init__(self, ground: tuple[int, int, int]) -> None:
        self._side = _CELL * _OVER
        self.image = Image.new("RGB", (self._side, self._side), ground)
        self._draw = ImageDraw.Draw(self.image)

    def _at(self, x: float, y: float) -> tuple[float, float]:
        inner = self._side * (1 - 2 * _MARGIN)
        return self._side * _MARGIN + x * inner, self._side * _MARGIN + y * inner

    def rect(self, x0: float, y0: float, x1: float, y1: float, fill: tuple[int, int, int], radius: float = 0.0) -> None:
        box = (*self._at(x0, y0), *self._at(x1, y1))
        self._draw.rounded_rectangle(box, radius=radius * self._side, fill=fill)

    def disc(self, x: float, y: float, rx: float, ry: float, fill: tuple[int, int, int]) -> None:
        self._draw.ellipse((*self._at(x - rx, y - ry), *self._at(x + rx, y + ry)), fill=fill)

    def poly(self, points: list[tuple[float, float]], fill: tuple[int, int, int]) -> None:
        self._draw.polygon([self._at(x, y) for x, y in points], fill=fill)

    def words(self, text: str, x0: float, y0: float, x1: float, y1: float, fill: tuple[int, int, int]) -> None:
        left, top, right, bottom = (round(v) for v in (*self._at(x0, y0), *self._at(x1, y1)))
        self.image.paste(fill, (left, top), lettering(text, right - left, bottom - top))


def _sheet(cells: dict[str, _Cell], places: dict[str, tuple[int, int]]) -> Image.Image:
    image = Image.new("RGB", (_SIZE * _OVER,) * 2)
    for name, (column, row) in places.items():
        image.paste(cells[name].image, (column * _CELL * _OVER, row * _CELL * _OVER))
    return image


def _plates() -> Image.Image:
    """Draws all plates; the margin around each has the colour of its edge."""
    image = Image.new("RGB", (_SIZE * _OVER,) * 2, (20, 20, 20))
    wide, high = (_OVER * (side - 2 * _PLATE_MARGIN_PX) for side in _PLATE)
    for k, text in enumerate((*PLATES.values(), *SHARED_PLATES)):
        column, row = k % _PLATE_COLUMNS, k // _PLATE_COLUMNS
        corner = (column * _PLATE[0] + _PLATE_MARGIN_PX, row * _PLATE[1] + _PLATE_MARGIN_PX)
        image.paste(draw_plate(text, wide, high), (corner[0] * _OVER, corner[1] * _OVER))
    return image


def _details() -> Image.Image:
    cells: dict[str, _Cell] = {}

    def cell(name: str, ground: tuple[int, int, int]) -> _Cell:
        cells[name] = _Cell(ground)
        return cells[name]

    cell("plastic", (44, 45, 47))
    cell("gloss", (14, 14, 15))
    cell("silver", (186, 188, 190))
    cell("rubber", (26, 26, 27))
    cell("wood", (120, 94, 66))
    cell("white", (218, 218, 214))
    bars = cell("bars", (12, 12, 13))
    for k in range(6):
        bars.rect(-0.1, k / 6 + 0.02, 1.1, k / 6 + 0.075, (120, 122, 125))
        bars.rect(-0.1, k / 6 + 0.075, 1.1, k / 6 + 0.10, (44, 45, 47))
    mesh = cell("mesh", (9, 9, 10))
    for k in range(-10, 22):
        for lean in (1, -1):
            x = k / 10
            mesh.poly([(x, 0), (x + 0.018, 0), (x + 0.018 + lean * 0.5, 1), (x + lean * 0.5, 1)], (40, 41, 43))
    rescue = cell("rescue", (226, 214, 40))
    for k in range(12):
        for row in range(2):
            if (k + row) % 2 == 0:
                rescue.rect(k / 12, row / 2, (k + 1) / 12, (row + 1) / 2, (186, 24, 26))
    taxi = cell("taxi", (236, 196, 40))
    taxi.words("TAXI", 0.08, 0.2, 0.94, 0.8, (18, 18, 18))
    slats = cell("slats", (30, 31, 33))
    for k in range(10):
        slats.rect(-0.1, k / 10, 1.1, k / 10 + 0.06, (70, 71, 74))
    display = cell("display", (10, 10, 11))
    display.words("24 CENTER", 0.02, 0.28, 0.98, 0.72, (255, 170, 40))
    chequer = cell("chequer", (222, 222, 218))
    for k in range(44):
        for row in range(2):
            if (k + row) % 2 == 0:
                chequer.rect(k / 44, row / 2, (k + 1) / 44, (row + 1) / 2, (18, 18, 20))
    battenburg = cell("battenburg", (24, 70, 190))
    for k in range(10):
        for row in range(2):
            if (k + row) % 2 == 0:
                battenburg.rect(k / 10, row / 2, (k + 1) / 10, (row + 1) / 2, (226, 214, 40))
    stripe = cell("stripe", (196, 24, 26))
    for k in range(-2, 6):
        stripe.poly([(k / 3, 1.1), (k / 3 + 0.18, 1.1), (k / 3 + 0.5, -0.1), (k / 3 + 0.32, -0.1)], (225, 225, 220))
    return _sheet(cells, _DETAILS)


def _lamps() -> Image.Image:
    cells: dict[str, _Cell] = {}

    def cell(name: str, ground: tuple[int, int, int]) -> _Cell:
        cells[name] = _Cell(ground)
        return cells[name]

    dark, bright, steel = (38, 40, 44), (244, 247, 250), (150, 154, 160)
    head = cell("head", (118, 122, 128))
    head.rect(-0.1, -0.1, 1.1, 1.1, (96, 100, 106))
    head.rect(-0.1, 0.0, 1.1, 0.12, bright)
    for x, r in ((0.30, 0.15), (0.66, 0.13)):
        head.disc(x, 0.56, r * 1.15, 0.40, (190, 194, 199))
        head.disc(x, 0.56, r, 0.34, dark)
        head.disc(x, 0.56, r * 0.72, 0.25, (205, 212, 220))
        head.disc(x - 0.03, 0.48, r * 0.32, 0.11, bright)
    head.rect(0.86, 0.2, 1.1, 0.9, (214, 150, 70))
    round_ = cell("head_round", (150, 154, 160))
    round_.disc(0.5, 0.5, 0.52, 0.52, (206, 210, 214))
    round_.disc(0.5, 0.5, 0.42, 0.42, (120, 124, 130))
    round_.disc(0.5, 0.5, 0.30, 0.30, (232, 238, 243))
    round_.disc(0.42, 0.4, 0.10, 0.10, (255, 255, 255))
    slim = cell("head_slim", (58, 60, 65))
    slim.rect(-0.1, 0.72, 1.1, 0.96, bright)
    for k in range(3):
        slim.rect(0.10 + 0.27 * k, 0.18, 0.30 + 0.27 * k, 0.58, (176, 182, 190), 0.02)
        slim.rect(0.14 + 0.27 * k, 0.24, 0.26 + 0.27 * k, 0.50, (238, 243, 248), 0.02)
    fog = cell("fog", dark)
    fog.disc(0.5, 0.5, 0.42, 0.42, steel)
    fog.disc(0.5, 0.5, 0.32, 0.32, (225, 230, 235))
    tail = cell("tail", (150, 10, 14))
    tail.rect(-0.1, 0.06, 1.1, 0.34, (205, 22, 24))
    tail.rect(0.05, 0.44, 0.48, 0.64, (226, 226, 224), 0.01)
    tail.rect(0.52, 0.44, 0.95, 0.64, (206, 120, 40), 0.01)
    tail.rect(-0.1, 0.72, 1.1, 0.92, (176, 14, 18))
    led = cell("tail_led", (96, 8, 12))
    led.rect(0.04, 0.14, 0.96, 0.34, (236, 40, 36), 0.03)
    led.rect(0.04, 0.62, 0.96, 0.80, (210, 26, 28), 0.03)
    led.rect(0.10, 0.42, 0.42, 0.54, (214, 214, 212), 0.01)
    tall = cell("tail_tall", (150, 10, 14))
    tall.rect(0.1, 0.03, 0.9, 0.34, (214, 26, 28), 0.03)
    tall.rect(0.1, 0.38, 0.9, 0.56, (206, 120, 40), 0.03)
    tall.rect(0.1, 0.60, 0.9, 0.76, (224, 224, 222), 0.03)
    tall.rect(0.1, 0.80, 0.9, 0.97, (190, 18, 20), 0.03)
    brake = cell("brake", (130, 8, 10))
    for k in range(10):
        brake.rect(k / 10 + 0.02, 0.2, k / 10 + 0.08, 0.8, (210, 26, 26))
    cell("amber", (214, 128, 30))
    reverse = cell("reverse", (205, 207, 208))
    reverse.rect(0.1, 0.1, 0.9, 0.9, (232, 234, 235))
    block = cell("tail_block", (30, 30, 32))
    for k, colour in enumerate([(206, 22, 24), (206, 120, 40), (224, 224, 222)]):
        block.rect(k / 3 + 0.015, 0.08, (k + 1) / 3 - 0.015, 0.92, colour, 0.02)
    cell("blue", (20, 60, 210))
    cell("drl", bright)
    cell("red", (196, 18, 20))
    wide = cell("head_block", dark)
    for x in (0.28, 0.72):
        wide.disc(x, 0.5, 0.2, 0.36, steel)
        wide.disc(x, 0.5, 0.15, 0.27, (232, 238, 243))
    cell("clear", (190, 194, 198))
    return _sheet(cells, _LAMPS)
