"""Pitched roofs of houses, with eaves, barge boards and gutters, around the origin; walls end at z = 0."""

from __future__ import annotations

import numpy as np

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder
from authoring.materials.registry import MATERIALS

EAVE_M = 0.42
VERGE_M = 0.28
SKIN_M = 0.14


def gable(
    length_m: float, span_m: float, rise_m: float, *, tiles: str, wall: str, trim: str, ends: str = "xX"
) -> list[Part]:
    """Makes a gable roof: two slopes with the ridge along x; `ends` names the gables with a triangle of wall and a
    verge.
    """
    sink = Sink("building")
    half, tile_m = span_m / 2, MATERIALS[tiles].tile_m
    low = -rise_m * EAVE_M / half
    x0 = -length_m / 2 - (VERGE_M if "x" in ends else 0.0)
    x1 = length_m / 2 + (VERGE_M if "X" in ends else 0.0)
    for sign in (-1, 1):
        eave, ridge = sign * (half + EAVE_M), 0.0
        left, right = (x0, x1) if sign < 0 else (x1, x0)
        top = [(left, eave, low + SKIN_M), (right, eave, low + SKIN_M), (right, ridge, rise_m + SKIN_M)]
        top.append((left, ridge, rise_m + SKIN_M))
        sink.quad(tiles, top, tile_m=tile_m)
        sink.swatch_quad(trim, [(x, y, z - SKIN_M) for x, y, z in top[::-1]])
        sink.swatch_quad(trim, [(left, eave, low), (right, eave, low), top[1], top[0]])
        gutter = sorted((eave, eave + sign * 0.11))
        sink.swatch_box("anthracite", (x0, gutter[0], low + 0.0), (x1, gutter[1], low + 0.1))
        for end, x in (("x", x0), ("X", x1)):
            if end in ends:
                board = [(x, eave, low), (x, eave, low + SKIN_M), (x, 0.0, rise_m + SKIN_M), (x, 0.0, rise_m)]
                outward = 1 if (end == "X") == (sign > 0) else -1
                sink.swatch_quad(trim, board[::outward])
    wall_tile = MATERIALS[wall].tile_m
    if "X" in ends:
        sink.quad(
            wall, [(length_m / 2, -half, 0), (length_m / 2, half, 0), (length_m / 2, 0, rise_m)], tile_m=wall_tile
        )
    if "x" in ends:
        sink.quad(
            wall, [(-length_m / 2, half, 0), (-length_m / 2, -half, 0), (-length_m / 2, 0, rise_m)], tile_m=wall_tile
        )
    top_m = rise_m + SKIN_M
    cap = "terracotta" if tiles == "tile_roof" else "slate"
    sink.swatch_box(cap, (x0, -0.11, top_m - 0.06), (x1, 0.11, top_m + 0.05), skip="z")
    return sink.parts()


def hip(length_m: float, span_m: float, rise_m: float, *, tiles: str, trim: str) -> list[Part]:
    """Makes a hip roof: four slopes over a rectangle that is at least as long as wide; the ridge runs along x."""
    sink = Sink("building")
    tile_m = MATERIALS[tiles].tile_m
    half = span_m / 2
    low = -rise_m * EAVE_M / half
    x, y, ridge = length_m / 2 + EAVE_M, half + EAVE_M, max(length_m / 2 - half, 0.05)
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    crest = [(-ridge, 0.0), (ridge, 0.0)]
    for index, ends in enumerate(((0, 1), (1, 1), (1, 0), (0, 0))):
        a, b = corners[index], corners[(index + 1) % 4]
        slope = [(*a, low + SKIN_M), (*b, low + SKIN_M), (*crest[ends[0] if index in (1, 3) else ends[1]], rise_m)]
        if index in (0, 2):
            slope.append((*crest[ends[0]], rise_m))
        sink.quad(tiles, slope, tile_m=tile_m)
        sink.swatch_quad(trim, [(*a, low), (*b, low), (*b, low + SKIN_M), (*a, low + SKIN_M)])
    sink.swatch_quad(trim, [(*corner, low) for corner in corners[::-1]])
    for box in ((-x, -y - 0.1, x, -y), (-x, y, x, y + 0.1), (-x - 0.1, -y, -x, y), (x, -y, x + 0.1, y)):
        sink.swatch_box("anthracite", (box[0], box[1], low), (box[2], box[3], low + 0.1))
    cap = "terracotta" if tiles == "tile_roof" else "slate"
    sink.swatch_box(cap, (-ridge - 0.1, -0.1, rise_m - 0.1), (ridge + 0.1, 0.1, rise_m + 0.06), skip="z")
    return sink.parts()


def chimney(sink: Sink, x: float, y: float, foot_m: float, top_m: float, *, brick: str, pots: int = 2) -> None:
    """Makes a chimney through a roof, with a corbelled head and a row of clay pots along y."""
    half_x, half_y = 0.32, 0.22 + 0.16 * pots
    tile_m = MATERIALS[brick].tile_m
    sink.tiled_box(brick, (x - half_x, y - half_y, foot_m), (x + half_x, y + half_y, top_m), tile_m=tile_m, skip="z")
    sink.swatch_box(
        "concrete_light",
        (x - half_x - 0.07, y - half_y - 0.07, top_m),
        (x + half_x + 0.07, y + half_y + 0.07, top_m + 0.1),
    )
    for offset in np.linspace(-half_y + 0.22, half_y - 0.22, pots):
        cylinder(sink, "terracotta", (x, y + float(offset), top_m + 0.1), 0.11, 0.4, segments=6)
