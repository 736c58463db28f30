"""Objects of gardens: fences, bins, letter boxes, sheds, a playground, clumps of far trees."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from authoring.kit.leaves import lump
from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, tube
from authoring.materials.registry import MATERIALS


def panel_fence(length_m: float, *, height_m: float = 1.7) -> list[Part]:
    """Close-boarded panels between posts along x, centred at the origin."""
    sink = Sink("fence")
    half, tile_m = length_m / 2, MATERIALS["wood"].tile_m
    sink.tiled_box("wood", (-half, -0.02, 0.06), (half, 0.02, height_m - 0.06), tile_m=tile_m, skip="zZ")
    sink.swatch_box("weathered_wood", (-half, -0.05, height_m - 0.06), (half, 0.05, height_m), skip="")
    for x in np.linspace(-half, half, max(2, round(length_m / 3.6) + 1)):
        low, high = (float(x) - 0.05, -0.06, 0.0), (float(x) + 0.05, 0.06, height_m + 0.08)
        sink.swatch_box("weathered_wood", low, high, skip="z")
    return sink.parts()


def picket_fence(length_m: float, *, swatch: str = "white_paint") -> list[Part]:
    """Painted pickets on two rails along x, centred at the origin, 0.9 m high."""
    sink = Sink("fence")
    half = length_m / 2
    for z in (0.25, 0.65):
        sink.swatch_box(swatch, (-half, 0.012, z), (half, 0.045, z + 0.07), skip="xX")
    for x in np.arange(-half + 0.06, half - 0.04, 0.19):
        left, right, x = float(x) - 0.045, float(x) + 0.045, float(x)
        face = [(left, 0.0, 0.06), (right, 0.0, 0.06), (right, 0.0, 0.82), (x, 0.0, 0.9), (left, 0.0, 0.82)]
        sink.swatch_quad(swatch, face)
        sink.swatch_quad(swatch, [(px, 0.012, pz) for px, _, pz in face[::-1]])
    for x in np.linspace(-half, half, max(2, round(length_m / 2.4) + 1)):
        low, high = (float(x) - 0.05, 0.0, 0.0), (float(x) + 0.05, 0.1, 0.98)
        sink.swatch_box(swatch, low, high, skip="z")
    return sink.parts()


def wheelie_bin(swatch: str) -> list[Part]:
    """A two-wheeled household bin, its front towards -y, 1.05 m high."""
    sink = Sink("static")
    low = [(-0.21, -0.24, 0.06), (0.21, -0.24, 0.06), (0.21, 0.22, 0.06), (-0.21, 0.22, 0.06)]
    top = [(-0.28, -0.33, 0.95), (0.28, -0.33, 0.95), (0.28, 0.3, 0.95), (-0.28, 0.3, 0.95)]
    for index in range(4):
        following = (index + 1) % 4
        sink.swatch_quad(swatch, [low[index], low[following], top[following], top[index]])
    sink.swatch_box(swatch, (-0.3, -0.36, 0.95), (0.3, 0.32, 1.02), skip="")
    sink.swatch_box("anthracite", (-0.24, 0.32, 0.93), (0.24, 0.38, 0.98), skip="")
    for x in (-0.26, 0.21):
        tube(sink, "rubber", [(x, 0.2, 0.1), (x + 0.05, 0.2, 0.1)], 0.1, segments=10, caps=True)
    return sink.parts()


def mail_box(swatch: str) -> list[Part]:
    """A private letter box on a post, its slot towards -y, 1.2 m high."""
    sink = Sink("static")
    sink.swatch_box("weathered_wood", (-0.05, -0.05, 0.0), (0.05, 0.05, 1.0), skip="z")
    sink.swatch_box(swatch, (-0.13, -0.24, 0.98), (0.13, 0.2, 1.2), skip="")
    sink.swatch_box(swatch, (-0.15, -0.26, 1.2), (0.15, 0.22, 1.23), skip="")
    sink.swatch_box("black_paint", (-0.1, -0.245, 1.11), (0.1, -0.24, 1.14), skip="Y")
    return sink.parts()


def shed(rng: np.random.Generator) -> list[Part]:
    """A wooden garden shed 2.4 m x 1.8 m, its door towards -y."""
    sink = Sink("building")
    tile_m = MATERIALS["wood"].tile_m
    sink.tiled_box("wood", (-1.2, -0.9, 0.05), (1.2, 0.9, 1.9), tile_m=tile_m, skip="zZ")
    for sign in (-1, 1):
        gable = [(sign * 1.2, -sign * 0.9, 1.9), (sign * 1.2, sign * 0.9, 1.9), (sign * 1.2, 0.0, 2.35)]
        sink.quad("wood", gable, tile_m=tile_m)
        slope = [(-sign * -1.3, sign * 1.0, 1.85), (-sign * 1.3, sign * 1.0, 1.85), (-sign * 1.3, 0.0, 2.4)]
        sink.swatch_quad("bitumen", [*slope[::1], (-sign * -1.3, 0.0, 2.4)])
    u = float(rng.uniform(-0.5, 0.5))
    sink.swatch_box("weathered_wood", (u - 0.4, -0.94, 0.1), (u + 0.4, -0.9, 1.85), skip="zY")
    return sink.parts()


def playground() -> list[Part]:
    """Swings, a tower with a slide, a climbing arch and a seesaw on about 16 m x 9 m."""
    sink = Sink("static")
    for x in (-7.0, -3.4):
        for y in (-1.1, 1.1):
            tube(sink, "signal_blue", [(x, y, 0.0), (x, 0.0, 2.4)], 0.05, segments=8)
    tube(sink, "signal_blue", [(-7.1, 0.0, 2.4), (-3.3, 0.0, 2.4)], 0.06, segments=8, caps=True)
    for x in (-6.1, -4.5):
        for dx in (-0.22, 0.22):
            tube(sink, "galvanised", [(x + dx, 0.0, 2.4), (x + dx, 0.15, 0.5)], 0.012, segments=5)
        sink.swatch_box("rubber", (x - 0.25, 0.05, 0.46), (x + 0.25, 0.25, 0.5))
    for x, y in ((0.2, -0.7), (1.6, -0.7), (1.6, 0.7), (0.2, 0.7)):
        sink.swatch_box("oak", (x - 0.06, y - 0.06, 0.0), (x + 0.06, y + 0.06, 2.5), skip="z")
    sink.swatch_box("oak", (0.1, -0.8, 1.35), (1.7, 0.8, 1.43))
    for y, sign in ((-0.95, -1), (0.95, 1)):
        slope = [(2.0, y, 2.4), (-0.2, y, 2.4), (-0.2, 0.0, 3.1), (2.0, 0.0, 3.1)][::sign]
        sink.swatch_quad("signal_red", slope)
        sink.swatch_quad("signal_red", [(px, py, pz - 0.04) for px, py, pz in slope[::-1]])
    for y in (-0.74, 0.7):
        sink.swatch_box("signal_green", (0.2, y, 1.6), (1.6, y + 0.04, 2.1))
    chute = [(1.7, 1.4), (2.2, 1.3), (3.9, 0.42), (4.6, 0.34)]
    for (xa, za), (xb, zb) in pairwise(chute):
        bed = [(xa, -0.3, za), (xb, -0.3, zb), (xb, 0.3, zb), (xa, 0.3, za)]
        sink.swatch_quad("signal_yellow", bed)
        sink.swatch_quad("signal_yellow", [(px, py, pz - 0.03) for px, py, pz in bed[::-1]])
        for y in (-0.3, 0.3):
            side = [(xa, y, za - 0.03), (xb, y, zb - 0.03), (xb, y, zb + 0.18), (xa, y, za + 0.18)]
            sink.swatch_quad("signal_yellow", side)
            sink.swatch_quad("signal_yellow", [(px, py + 0.002, pz) for px, py, pz in side[::-1]])
    for rung in np.arange(0.25, 1.3, 0.27):
        tube(sink, "galvanised", [(0.1, -0.35, rung), (0.1, 0.35, rung)], 0.025, segments=6)
    angle = np.linspace(0, np.pi, 9)
    arch = np.stack([6.4 + 1.2 * np.cos(angle), np.zeros(9), 1.9 * np.sin(angle)], 1)
    for y in (-0.6, 0.6):
        tube(sink, "orange", np.add(arch, (0.0, y, 0.0)), 0.04, segments=7)
    for x, _, z in arch[1:-1]:
        tube(sink, "orange", [(x, -0.6, z), (x, 0.6, z)], 0.025, segments=6)
    cylinder(sink, "anthracite", (-1.0, -3.0, 0.0), 0.12, 0.5, segments=10)
    sink.swatch_box("signal_green", (-2.6, -3.12, 0.5), (0.6, -2.88, 0.58))
    return sink.parts()


def clump(sink: Sink, x: float, y: float, z: float, height_m: float, rng: np.random.Generator) -> None:
    """Adds a group of distant trees: masses of foliage without leaves or trunks."""
    foliage = str(rng.choice(["foliage_green", "foliage_dark"]))
    around = np.array([x, y, z])
    for index in range(3):
        tall = height_m * float(rng.uniform(0.6, 1.0))
        offset = rng.uniform(-0.55, 0.55, 2) * height_m * (index > 0)
        centre = np.array([x + offset[0], y + offset[1], z + tall * 0.5])
        lump(sink, foliage, centre, np.array([0.42, 0.42, 0.58]) * tall, around=around, detail=0, rng=rng)
