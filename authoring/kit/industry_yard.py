"""Objects of yards and motorways: containers, netting, noise walls, gantries, direction signs."""

from __future__ import annotations

import numpy as np

from authoring.kit.industry_plant import strut
from authoring.kit.parts import Part, Sink, box_faces
from authoring.kit.shapes import cylinder
from authoring.kit.signs import BACK
from authoring.materials.freight import LINERS, container_rect, panel_rect

CONTAINER_M = (12.19, 2.44, 2.59)
SHORT_M = 6.06
NET_PITCH_M = 0.5


def container(sink: Sink, liner: int, x: float, y: float, z: float, *, short: bool = False) -> None:
    """Adds one container along x: its middle is at (x, y), its floor at z, and its doors face +x."""
    half_x, half_y = (SHORT_M if short else CONTAINER_M[0]) / 2, CONTAINER_M[1] / 2
    faces = box_faces((x - half_x, y - half_y, z), (x + half_x, y + half_y, z + CONTAINER_M[2]))
    for face in "yYxXZ":
        u0, v0, u1, v1 = container_rect(liner, door=face == "X")
        if face == "x":
            u1 = u0 + (u1 - u0) * 0.2
        elif face == "Z":
            v1 = v0 + (v1 - v0) * 0.15
            u0, u1 = u0 + 0.02, u0 + 0.1
        elif face in "yY" and short:
            u1 = u0 + (u1 - u0) * 0.74
            u0 += 0.12 * (u1 - u0)
        sink.polygon("containers", faces[face], [(u0, v0), (u1, v0), (u1, v1), (u0, v1)], label="static")


def container_stack(rows: int, columns: int, rng: np.random.Generator, *, highest: int = 4) -> list[Part]:
    """A block of stacked containers: `rows` across y, `columns` along x, with a random height of each stack."""
    sink = Sink("static")
    long, wide, tall = CONTAINER_M
    height = int(rng.integers(2, highest + 1))
    for column in range(columns):
        for row in range(rows):
            height = int(np.clip(height + rng.integers(-1, 2), 1, highest))
            x, y = (column - (columns - 1) / 2) * (long + 0.5), (row - (rows - 1) / 2) * (wide + 0.35)
            for level in range(height):
                liner, short = int(rng.integers(len(LINERS))), rng.random() < 0.2
                shift = float(rng.uniform(-0.05, 0.05))
                if short:
                    for half in (-1, 1):
                        container(sink, liner + half, x + half * (SHORT_M / 2 + 0.03), y, level * tall, short=True)
                else:
                    container(sink, liner, x + shift, y, level * tall)
    return sink.parts()


def pallets(rng: np.random.Generator) -> list[Part]:
    """Makes goods in a yard: stacks of pallets, crates under film, liquid containers in their cages, drums."""
    sink = Sink("static")
    for column in range(int(rng.integers(3, 6))):
        x, y = column * 1.6 - 3.0, float(rng.uniform(-0.4, 0.4))
        kind = int(rng.integers(4))
        if kind == 0:
            for level in range(int(rng.integers(3, 9))):
                z = level * 0.145
                sink.swatch_box("weathered_wood", (x - 0.6, y - 0.5, z + 0.1), (x + 0.6, y + 0.5, z + 0.14))
                for v in (-0.45, 0.0, 0.35):
                    sink.swatch_box("oak", (x - 0.6, y + v, z), (x + 0.6, y + v + 0.1, z + 0.1), skip="zZ")
        elif kind == 1:
            for level in range(int(rng.integers(1, 3))):
                swatch = str(rng.choice(["canvas_sand", "plastic_white", "signal_blue", "teal_paint"]))
                sink.swatch_box(
                    "weathered_wood", (x - 0.6, y - 0.5, level * 1.3), (x + 0.6, y + 0.5, level * 1.3 + 0.14)
                )
                sink.swatch_box(
                    swatch, (x - 0.58, y - 0.48, level * 1.3 + 0.14), (x + 0.58, y + 0.48, level * 1.3 + 1.3), skip="z"
                )
        elif kind == 2:
            sink.swatch_box("plastic_white", (x - 0.55, y - 0.45, 0.15), (x + 0.55, y + 0.45, 1.1))
            for z in (0.0, 0.4, 0.75, 1.1):
                sink.swatch_box("galvanised", (x - 0.6, y - 0.5, z), (x + 0.6, y + 0.5, z + 0.05), skip="")
        else:
            for u, v in ((-0.3, -0.3), (0.3, -0.3), (0.0, 0.25)):
                swatch = str(rng.choice(["signal_blue", "dark_red", "mustard"]))
                cylinder(sink, swatch, (x + u, y + v, 0), 0.29, 0.88, segments=12)
    return sink.parts()


def chain_link(length_m: float, *, height_m: float = 2.2) -> list[Part]:
    """Makes wire netting along x on posts with outriggers and barbed wire; the wires are thick enough to be visible."""
    sink = Sink("fence")
    half, wire = length_m / 2, 0.006
    count = max(1, round(length_m / 3.0))
    for x in np.linspace(-half + 0.05, half - 0.05, count + 1):
        cylinder(sink, "galvanised", (x, 0, 0), 0.035, height_m, segments=6, cap=False)
        strut(sink, np.array([x, 0, height_m]), np.array([x, -0.3, height_m + 0.35]), 0.05)
    for y, z in ((0.0, height_m - 0.03), (0.0, 0.08), (-0.15, height_m + 0.18), (-0.3, height_m + 0.35)):
        sink.swatch_box("galvanised", (-half, y - 0.01, z - 0.01), (half, y + 0.01, z + 0.01), skip="xX")
    span = height_m - 0.1
    for slope in (1, -1):
        for start in np.arange(-half - span, half, NET_PITCH_M):
            x0, x1 = max(start, -half), min(start + span, half)
            if x1 - x0 < 0.05:
                continue
            z0, z1 = (x0 - start, x1 - start) if slope > 0 else (span - x0 + start, span - x1 + start)
            low, high = np.array([x0, 0.0, 0.08 + z0]), np.array([x1, 0.0, 0.08 + z1])
            side = np.array([-(high - low)[2], 0.0, (high - low)[0]])
            side *= wire / np.linalg.norm(side)
            quad = [low - side, high - side, high + side, low + side]
            sink.swatch_quad("galvanised", quad)
            sink.swatch_quad("galvanised", quad[::-1])
    return sink.parts()


def noise_wall(length_m: float, *, height_m: float = 3.6) -> list[Part]:
    """Panels between steel posts along x, a coloured band near the top."""
    sink = Sink("wall")
    half = length_m / 2
    sink.tiled_box("concrete", (-half, -0.1, 0), (half, 0.1, 0.8), tile_m=4.0, skip="zZ")
    sink.tiled_box("wood", (-half, -0.08, 0.8), (half, 0.08, height_m - 0.7), tile_m=2.0, skip="zZ")
    sink.swatch_box("copper_green", (-half, -0.09, height_m - 0.7), (half, 0.09, height_m), skip="z")
    for x in np.linspace(-half, half, max(1, round(length_m / 4.0)) + 1):
        sink.swatch_box("galvanised", (x - 0.1, -0.16, 0), (x + 0.1, 0.16, height_m + 0.05), skip="z")
    return sink.parts()


def gantry(span_m: float, panels: tuple[int, ...]) -> list[Part]:
    """A truss over a carriageway, legs at y = 0 and y = span_m, its signs looking towards -x."""
    sink = Sink("pole")
    low, high = 6.3, 7.5
    for y in (0.0, span_m):
        for x in (-0.5, 0.5):
            sink.swatch_box("galvanised", (x - 0.14, y - 0.14, 0), (x + 0.14, y + 0.14, high + 0.1), skip="z")
        for z in np.arange(0.6, low, 1.4):
            strut(sink, np.array([-0.5, y, z]), np.array([0.5, y, z + 1.4]), 0.08)
        sink.tiled_box("concrete", (-0.9, y - 0.4, 0), (0.9, y + 0.4, 0.5), tile_m=4.0, skip="z")
    for x in (-0.5, 0.5):
        for z in (low, high):
            strut(sink, np.array([x, 0.0, z]), np.array([x, span_m, z]), 0.16)
    steps = max(2, round(span_m / 1.6))
    ends = np.linspace(0, span_m, steps + 1)
    for index in range(steps):
        z0, z1 = (low, high) if index % 2 else (high, low)
        for x in (-0.5, 0.5):
            strut(sink, np.array([x, ends[index], z0]), np.array([x, ends[index + 1], z1]), 0.08)
    pitch = span_m / len(panels)
    for index, panel in enumerate(panels):
        _panel(sink, panel, (index + 0.5) * pitch, low - 0.35, 5.4)
    return sink.parts()


def direction_sign(panel: int, *, width_m: float = 5.0) -> list[Part]:
    """A large sign on two posts, looking towards -x."""
    sink = Sink("pole")
    for y in (-width_m * 0.3, width_m * 0.3):
        sink.swatch_box("galvanised", (0.05, y - 0.1, 0), (0.25, y + 0.1, 2.0 + width_m / 2), skip="z")
    _panel(sink, panel, 0.0, 1.9, width_m, front=-0.02)
    return sink.parts()


def _panel(sink: Sink, panel: int, y: float, z: float, width_m: float, *, front: float = -0.72) -> None:
    half, high = width_m / 2, width_m / 2
    sink.swatch_box("galvanised", (front + 0.005, y - half, z), (front + 0.07, y + half, z + high), label=BACK)
    u0, v0, u1, v1 = panel_rect(panel)
    corners = [(front, y + half, z), (front, y - half, z), (front, y - half, z + high), (front, y + half, z + high)]
    sink.polygon("direction_signs", corners, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)], label="traffic_sign")
