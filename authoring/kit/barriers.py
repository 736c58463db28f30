"""Barriers beside streets: fences, walls, guard rails, bridge railings. All run along x, centred at the origin."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder
from authoring.materials.registry import MATERIALS


def fence(length_m: float, *, style: str = "bars", height_m: float = 1.4) -> list[Part]:
    """Makes a fence of the style `bars` (iron palings), `mesh` (crossed wire rods between posts) or `wood` (boards)."""
    sink = Sink("fence")
    makers = {"bars": _bars, "mesh": _mesh, "wood": _boards}
    if style not in makers:
        raise ValueError(f"no fence style named {style!r}; there are {', '.join(makers)}")
    makers[style](sink, length_m, height_m)
    return sink.parts()


def wall(length_m: float, *, material: str = "brick_red", height_m: float = 1.8, thick_m: float = 0.3) -> list[Part]:
    """Makes a free-standing wall of a tiling material, with piers and a coping."""
    sink = Sink("wall")
    half_x, half_y = length_m / 2, thick_m / 2
    tile_m = MATERIALS[material].tile_m
    sink.tiled_box(material, (-half_x, -half_y, 0), (half_x, half_y, height_m), tile_m=tile_m, skip="zZ")
    sink.swatch_box("concrete_light", (-half_x, -half_y - 0.04, height_m), (half_x, half_y + 0.04, height_m + 0.09))
    for x in _posts(length_m, 4.0):
        sink.tiled_box(
            material,
            (x - 0.22, -half_y - 0.08, 0),
            (x + 0.22, half_y + 0.08, height_m + 0.09),
            tile_m=tile_m,
            skip="zZ",
        )
        sink.swatch_box(
            "concrete_light", (x - 0.27, -half_y - 0.13, height_m + 0.09), (x + 0.27, half_y + 0.13, height_m + 0.2)
        )
    return sink.parts()


def seat_wall(length_m: float, *, height_m: float = 0.42) -> list[Part]:
    """Makes a low wall of ashlar, 0.45 m deep, with a slab on top that serves as a seat."""
    sink = Sink("wall")
    half, tile_m = length_m / 2, MATERIALS["ashlar"].tile_m
    sink.tiled_box("ashlar", (-half, -0.18, 0), (half, 0.18, height_m), tile_m=tile_m, skip="zZ")
    sink.swatch_box("concrete_light", (-half - 0.04, -0.225, height_m), (half + 0.04, 0.225, height_m + 0.08))
    return sink.parts()


def guard_rail(length_m: float) -> list[Part]:
    """Makes a guard rail: a W-shaped steel beam on posts, 0.75 m high, with its face towards -y."""
    sink = Sink("guard_rail")
    half = length_m / 2
    outline = [
        (0.0, 0.44),
        (-0.08, 0.48),
        (-0.08, 0.54),
        (-0.02, 0.58),
        (-0.02, 0.61),
        (-0.08, 0.65),
        (-0.08, 0.71),
        (0.0, 0.75),
    ]
    for (y0, z0), (y1, z1) in itertools.pairwise(outline):
        front = [(-half, y0, z0), (half, y0, z0), (half, y1, z1), (-half, y1, z1)]
        sink.swatch_quad("galvanised", front)
        sink.swatch_quad("galvanised", [front[0], front[3], front[2], front[1]])
    for x in _posts(length_m, 2.0):
        sink.swatch_box("galvanised", (x - 0.05, 0.02, 0), (x + 0.05, 0.14, 0.78), skip="z")
    return sink.parts()


def bridge_railing(length_m: float, *, height_m: float = 1.15) -> list[Part]:
    """Makes a railing of steel posts, a broad handrail and upright bars on a concrete kerb; its label is `bridge`."""
    sink = Sink("bridge")
    half = length_m / 2
    sink.tiled_box("concrete", (-half, -0.18, 0), (half, 0.18, 0.22), tile_m=4.0, skip="z")
    sink.swatch_box("galvanised", (-half, -0.05, height_m - 0.07), (half, 0.05, height_m))
    sink.swatch_box("galvanised", (-half, -0.02, 0.32), (half, 0.02, 0.36), skip="xX")
    for x in _posts(length_m, 2.0):
        sink.swatch_box("galvanised", (x - 0.045, -0.06, 0.22), (x + 0.045, 0.06, height_m - 0.07), skip="zZ")
    for x in np.arange(-half + 0.1, half - 0.05, 0.12):
        sink.swatch_box("galvanised", (x - 0.009, -0.009, 0.36), (x + 0.009, 0.009, height_m - 0.07), skip="zZ")
    return sink.parts()


def jersey_barrier(length_m: float) -> list[Part]:
    """Makes a concrete barrier with the New Jersey profile; its label is `wall`."""
    sink = Sink("wall")
    half = length_m / 2
    outline = [
        (-0.3, 0.0),
        (-0.3, 0.08),
        (-0.16, 0.3),
        (-0.09, 0.82),
        (0.09, 0.82),
        (0.16, 0.3),
        (0.3, 0.08),
        (0.3, 0.0),
    ]
    for (y0, z0), (y1, z1) in itertools.pairwise(outline):
        sink.quad("concrete", [(-half, y0, z0), (half, y0, z0), (half, y1, z1), (-half, y1, z1)], tile_m=4.0)
    for sign in (-1, 1):
        end = [(sign * half, sign * y, z) for y, z in outline]
        for a, b, c, d in ((0, 1, 6, 7), (1, 2, 5, 6), (2, 3, 4, 5)):
            sink.quad("concrete", [end[a], end[d], end[c], end[b]], tile_m=4.0)
    return sink.parts()


def _bars(sink: Sink, length_m: float, height_m: float) -> None:
    half = length_m / 2
    for z in (0.15, height_m - 0.16):
        sink.swatch_box("black_paint", (-half, -0.015, z), (half, 0.015, z + 0.04), skip="xX")
    for x in _posts(length_m, 2.5):
        sink.swatch_box("black_paint", (x - 0.035, -0.035, 0), (x + 0.035, 0.035, height_m + 0.06), skip="z")
    for x in np.arange(-half + 0.07, half - 0.05, 0.125):
        sink.swatch_box("black_paint", (x - 0.009, -0.009, 0.05), (x + 0.009, 0.009, height_m), skip="zZ")
        tip = (x, 0.0, height_m + 0.09)
        foot = [
            (x - 0.016, -0.016, height_m),
            (x + 0.016, -0.016, height_m),
            (x + 0.016, 0.016, height_m),
            (x - 0.016, 0.016, height_m),
        ]
        for i in range(4):
            sink.swatch_quad("black_paint", [foot[i], foot[(i + 1) % 4], tip])


def _mesh(sink: Sink, length_m: float, height_m: float) -> None:
    """Adds wire netting of crossing rods, which are thick enough to be visible, with gaps between them."""
    half, rod = length_m / 2, 0.006
    for x in _posts(length_m, 2.5):
        cylinder(sink, "galvanised", (x, 0, 0), 0.03, height_m + 0.05, segments=8)
    for z in (0.08, height_m - 0.03):
        sink.swatch_box("galvanised", (-half, -0.012, z), (half, 0.012, z + 0.024), skip="xX")
    span = height_m - 0.12
    for slope in (1, -1):
        for start in np.arange(-half - span, half, 0.14):
            x0, x1 = max(start, -half), min(start + span, half)
            if x1 - x0 < 0.05:
                continue
            z0, z1 = x0 - start, x1 - start
            if slope < 0:
                z0, z1 = span - z0, span - z1
            low, high = np.array([x0, 0.0, 0.09 + z0]), np.array([x1, 0.0, 0.09 + z1])
            side = np.array([-(high - low)[2], 0.0, (high - low)[0]])
            side *= rod / np.linalg.norm(side)
            sink.swatch_quad("galvanised", [low - side, high - side, high + side, low + side])
            sink.swatch_quad("galvanised", [low - side, low + side, high + side, high - side])


def _boards(sink: Sink, length_m: float, height_m: float) -> None:
    half = length_m / 2
    for z in (0.3, height_m - 0.35):
        sink.swatch_box("weathered_wood", (-half, 0.0, z), (half, 0.04, z + 0.09), skip="xX")
    for x in _posts(length_m, 2.2):
        sink.swatch_box("weathered_wood", (x - 0.05, 0.0, 0), (x + 0.05, 0.1, height_m), skip="z")
    tile_m = MATERIALS["wood"].tile_m
    for index, x in enumerate(np.arange(-half + 0.01, half - 0.1, 0.135)):
        top = height_m + 0.02 * (index % 3)
        sink.tiled_box("wood", (x, -0.022, 0.05), (x + 0.12, 0.0, top), tile_m=tile_m, skip="zY")
        sink.swatch_quad("weathered_wood", [(x + 0.12, 0, 0.05), (x, 0, 0.05), (x, 0, top), (x + 0.12, 0, top)])


def _posts(length_m: float, pitch_m: float) -> list[float]:
    count = max(1, round(length_m / pitch_m))
    return [float(x) for x in np.linspace(-length_m / 2 + 0.06, length_m / 2 - 0.06, count + 1)]
