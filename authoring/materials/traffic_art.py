"""The pictures on traffic signs, drawn from polygons and strokes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from authoring.materials.atlas import TRAFFIC_SIGNS
from authoring.materials.canvas import Canvas, Colour, tiled
from authoring.materials.image import Image
from authoring.materials.noise import tileable_noise

Textures = dict[str, Image]
WHITE, RED, BLUE, BLACK, YELLOW = (
    (0.70, 0.70, 0.68),
    (0.45, 0.018, 0.02),
    (0.015, 0.09, 0.36),
    (0.02, 0.02, 0.02),
    (0.66, 0.42, 0.015),
)


def traffic_signs(*, rng: np.random.Generator) -> Textures:
    """Sixteen signs, 256 px each, a little faded and dusty."""
    cells = []
    for name in TRAFFIC_SIGNS:
        cell = Canvas(256, 256, oversample=4)
        _SIGN_PAINTERS[name](cell)
        dust = tileable_noise(cell.size[0], period=4, octaves=5, rng=rng)
        cell.albedo *= (1 + 0.06 * dust)[..., None]
        cells.append(cell.image())
    return {"traffic_signs": tiled(cells, 4)}


def _disc(cell: Canvas, rim: Colour, ground: Colour, *, inner: float = 0.36) -> None:
    cell.fill(rim)
    cell.ellipse(0.5, 0.5, inner, inner, ground)


def _stop(cell: Canvas) -> None:
    cell.fill(WHITE)
    angle = np.radians(22.5 + np.arange(8) * 45)
    radius = 0.5 / np.cos(np.pi / 8) * 0.92
    cell.polygon(np.stack([0.5 + radius * np.cos(angle), 0.5 + radius * np.sin(angle)], 1), RED)
    cell.text("STOP", 0.5, 0.5, 0.235, WHITE, weight=0.15)


def _triangle(cell: Canvas, *, down: bool) -> None:
    cell.fill(RED)
    points = np.array([(0.5, 0.8), (0.2, 0.235), (0.8, 0.235)])
    cell.polygon(points if down else points * (1, -1) + (0, 1), WHITE)


def _warning(cell: Canvas) -> None:
    _triangle(cell, down=False)
    for x, tall in ((0.43, 1.0), (0.57, 0.85)):
        y = 0.72 - 0.30 * tall
        cell.ellipse(x, y, 0.03, 0.03, BLACK)
        cell.line([(x, y + 0.03), (x, y + 0.17 * tall)], 0.045, BLACK)
        cell.line([(x, y + 0.15 * tall), (x - 0.05, 0.73)], 0.025, BLACK)
        cell.line([(x, y + 0.15 * tall), (x + 0.05, 0.73)], 0.025, BLACK)
        cell.line([(x - 0.07, y + 0.1), (x + 0.07, y + 0.07)], 0.025, BLACK)


def _priority(cell: Canvas) -> None:
    cell.fill(WHITE)
    cell.polygon([(0.5, 0.13), (0.87, 0.5), (0.5, 0.87), (0.13, 0.5)], YELLOW)


def _no_entry(cell: Canvas) -> None:
    cell.fill(RED)
    cell.rect(0.17, 0.42, 0.83, 0.58, WHITE)


def _speed(limit: str) -> Callable[[Canvas], None]:
    def paint(cell: Canvas) -> None:
        _disc(cell, RED, WHITE, inner=0.375)
        cell.text(limit, 0.5, 0.5, 0.33, BLACK, weight=0.13)

    return paint


def _arrow(cell: Canvas, tail: tuple[float, float], tip: tuple[float, float], colour: Colour, width: float) -> None:
    start, end = np.asarray(tail), np.asarray(tip)
    along = (end - start) / np.linalg.norm(end - start)
    side = np.array([-along[1], along[0]])
    neck = end - along * width * 1.8
    points = [
        start - side * width / 2,
        neck - side * width / 2,
        neck - side * width * 1.3,
        end,
        neck + side * width * 1.3,
        neck + side * width / 2,
        start + side * width / 2,
    ]
    cell.polygon(points, colour)


def _one_way(cell: Canvas) -> None:
    cell.fill(BLUE)
    _arrow(cell, (0.08, 0.5), (0.92, 0.5), WHITE, 0.13)


def _parking(cell: Canvas) -> None:
    cell.fill(BLUE)
    cell.line([(0.36, 0.82), (0.36, 0.2), (0.52, 0.2)], 0.12, WHITE)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 20)
    cell.line(np.stack([0.52 + 0.15 * np.cos(angle), 0.355 + 0.155 * np.sin(angle)], 1), 0.12, WHITE)
    cell.line([(0.36, 0.51), (0.52, 0.51)], 0.12, WHITE)


def _crossing(cell: Canvas) -> None:
    cell.fill(BLUE)
    cell.polygon([(0.5, 0.12), (0.9, 0.82), (0.1, 0.82)], WHITE)
    cell.ellipse(0.52, 0.34, 0.04, 0.04, BLACK)
    cell.line([(0.51, 0.4), (0.49, 0.56)], 0.07, BLACK)
    cell.line([(0.49, 0.56), (0.58, 0.76)], 0.04, BLACK)
    cell.line([(0.49, 0.56), (0.41, 0.76)], 0.04, BLACK)
    cell.line([(0.51, 0.43), (0.62, 0.52)], 0.03, BLACK)
    cell.line([(0.51, 0.43), (0.41, 0.53)], 0.03, BLACK)
    for x in (0.24, 0.36, 0.62, 0.74):
        cell.rect(x - 0.03, 0.775, x + 0.03, 0.805, BLACK)


def _turn_right(cell: Canvas) -> None:
    cell.fill(WHITE)
    cell.ellipse(0.5, 0.5, 0.47, 0.47, BLUE)
    cell.line([(0.36, 0.78), (0.36, 0.46), (0.5, 0.46)], 0.1, WHITE)
    _arrow(cell, (0.45, 0.46), (0.8, 0.46), WHITE, 0.1)


def _no_parking(cell: Canvas) -> None:
    _disc(cell, RED, BLUE, inner=0.38)
    cell.line([(0.22, 0.22), (0.78, 0.78)], 0.09, RED)


def _roundabout(cell: Canvas) -> None:
    cell.fill(WHITE)
    cell.ellipse(0.5, 0.5, 0.47, 0.47, BLUE)
    for turn in range(3):
        angle = np.radians(turn * 120 + np.linspace(0, 75, 10))
        arc = np.stack([0.5 + 0.24 * np.cos(angle), 0.5 - 0.24 * np.sin(angle)], 1)
        cell.line(arc, 0.075, WHITE)
        _arrow(cell, tuple(arc[-2]), tuple(arc[-1] + (arc[-1] - arc[-2]) * 3.4), WHITE, 0.075)


def _street_name(cell: Canvas) -> None:
    cell.fill((0.015, 0.07, 0.05))
    cell.line([(0.03, 0.39), (0.97, 0.39), (0.97, 0.61), (0.03, 0.61)], 0.008, WHITE, closed=True)
    cell.text("Via Lumera", 0.5, 0.5, 0.105, WHITE, weight=0.13)


def _bus_stop(cell: Canvas) -> None:
    cell.fill(BLUE)
    cell.rect(0.14, 0.14, 0.86, 0.86, WHITE)
    cell.rect(0.24, 0.3, 0.76, 0.68, BLUE)
    for x in (0.29, 0.42, 0.55):
        cell.rect(x, 0.36, x + 0.1, 0.48, WHITE)
    for x in (0.34, 0.66):
        cell.ellipse(x, 0.69, 0.055, 0.055, BLUE)


def _chevron(cell: Canvas) -> None:
    cell.fill(RED)
    for x in (0.1, 0.42, 0.74):
        cell.polygon(
            [(x, 0.05), (x + 0.13, 0.05), (x + 0.29, 0.5), (x + 0.13, 0.95), (x, 0.95), (x + 0.16, 0.5)], WHITE
        )


_SIGN_PAINTERS = {
    "stop": _stop,
    "yield": lambda cell: _triangle(cell, down=True),
    "priority": _priority,
    "no_entry": _no_entry,
    "speed_30": _speed("30"),
    "speed_50": _speed("50"),
    "one_way": _one_way,
    "parking": _parking,
    "crossing": _crossing,
    "turn_right": _turn_right,
    "no_parking": _no_parking,
    "warning_children": _warning,
    "roundabout": _roundabout,
    "street_name": _street_name,
    "bus_stop": _bus_stop,
    "chevron": _chevron,
}
