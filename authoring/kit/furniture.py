"""Small street furniture. Each piece stands at the origin; a piece with a front shows it towards -y."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, disc, dome, tube


def bin_(*, style: str = "post") -> list[Part]:
    """A litter bin: `post` (green, on a post), `steel` (round with a lid) or `wheelie` (household, with wheels)."""
    sink = Sink("static")
    if style == "post":
        cylinder(sink, "galvanised", (0, 0.2, 0), 0.03, 1.05, segments=8)
        cylinder(sink, "plastic_green", (0, 0, 0.35), 0.17, 0.55, top_radius_m=0.2, segments=16, cap=False)
        disc(sink, "rubber", (0, 0, 0.895), 0.198, segments=16)
        tube(
            sink,
            "plastic_green",
            [(0.2 * np.cos(a), 0.2 * np.sin(a), 0.9) for a in np.linspace(0, 2 * np.pi, 17)],
            0.015,
            segments=6,
        )
    elif style == "steel":
        cylinder(sink, "anthracite", (0, 0, 0), 0.24, 0.06, segments=20, cap=False)
        cylinder(sink, "steel", (0, 0, 0.06), 0.26, 0.74, segments=20)
        cylinder(sink, "rubber", (0, 0, 0.8), 0.22, 0.12, segments=20, cap=False)
        cylinder(sink, "anthracite", (0, 0, 0.92), 0.28, 0.05, segments=20)
        dome(sink, "anthracite", (0, 0, 0.97), 0.27, 0.1, segments=20, rings=3)
    elif style == "wheelie":
        sink.swatch_box("plastic_grey", (-0.26, -0.28, 0.06), (0.26, 0.28, 0.95), skip="")
        sink.swatch_box("dark_green", (-0.29, -0.33, 0.95), (0.29, 0.32, 1.02), skip="")
        sink.swatch_box("plastic_grey", (-0.24, 0.3, 0.88), (0.24, 0.38, 0.92), skip="")
        for x in (-0.27, 0.27):
            tube(sink, "rubber", [(x - 0.03, 0.25, 0.1), (x + 0.03, 0.25, 0.1)], 0.1, segments=12, caps=True)
    else:
        raise ValueError(f"no bin style named {style!r}; there are post, steel, wheelie")
    return sink.parts()


def bench(*, style: str = "wood") -> list[Part]:
    """A 1.8 m bench whose sitters look towards -y: `wood` slats on iron, or `stone` without a back."""
    sink = Sink("bench")
    if style == "stone":
        sink.tiled_box("concrete", (-0.9, -0.25, 0.32), (0.9, 0.25, 0.45), tile_m=4.0)
        for x in (-0.6, 0.6):
            sink.tiled_box("concrete", (x - 0.12, -0.2, 0), (x + 0.12, 0.2, 0.32), tile_m=4.0, skip="zZ")
        return sink.parts()
    if style != "wood":
        raise ValueError(f"no bench style named {style!r}; there are wood, stone")
    for y in (-0.22, -0.1, 0.02, 0.14):
        sink.swatch_box("teak", (-0.9, y, 0.43), (0.9, y + 0.095, 0.465))
    for z, y in ((0.56, 0.285), (0.69, 0.32), (0.82, 0.355)):
        sink.swatch_box("teak", (-0.9, y, z), (0.9, y + 0.03, z + 0.1))
    for x in (-0.78, 0.0, 0.78):
        sink.swatch_box("black_paint", (x - 0.025, -0.22, 0.39), (x + 0.025, 0.27, 0.43))
        tube(sink, "black_paint", [(x, -0.18, 0), (x, -0.2, 0.4)], 0.025, segments=6)
        tube(sink, "black_paint", [(x, 0.34, 0), (x, 0.25, 0.4), (x, 0.4, 0.95)], 0.025, segments=6, caps=True)
        if x:
            tube(sink, "black_paint", [(x, -0.2, 0.4), (x, -0.22, 0.62), (x, 0.3, 0.66)], 0.02, segments=6)
    return sink.parts()


def bollard(*, style: str = "iron") -> list[Part]:
    """A bollard: `iron` (0.95 m, with a white ring), `steel` (brushed tube) or `concrete` (ball)."""
    sink = Sink("pole")
    if style == "iron":
        cylinder(sink, "black_paint", (0, 0, 0), 0.09, 0.1, segments=14)
        cylinder(sink, "black_paint", (0, 0, 0.1), 0.065, 0.62, top_radius_m=0.055, segments=14, cap=False)
        cylinder(sink, "white_paint", (0, 0, 0.72), 0.058, 0.08, segments=14, cap=False)
        cylinder(sink, "black_paint", (0, 0, 0.8), 0.055, 0.06, top_radius_m=0.075, segments=14, cap=False)
        dome(sink, "black_paint", (0, 0, 0.86), 0.075, 0.08, segments=14)
    elif style == "steel":
        cylinder(sink, "steel", (0, 0, 0), 0.055, 0.9, segments=16)
        cylinder(sink, "white_paint", (0, 0, 0.76), 0.056, 0.07, segments=16, cap=False)
    elif style == "concrete":
        cylinder(sink, "concrete_light", (0, 0, 0), 0.2, 0.15, segments=18, cap=False)
        cylinder(sink, "concrete_light", (0, 0, 0.15), 0.2, 0.13, top_radius_m=0.26, segments=18, cap=False)
        dome(sink, "concrete_light", (0, 0, 0.28), 0.26, 0.26, segments=18)
    else:
        raise ValueError(f"no bollard style named {style!r}; there are iron, steel, concrete")
    return sink.parts()


def fire_hydrant() -> list[Part]:
    """An American pillar hydrant, 0.8 m, red with white caps."""
    sink = Sink("fire_hydrant")
    cylinder(sink, "signal_red", (0, 0, 0), 0.17, 0.06, segments=16)
    cylinder(sink, "signal_red", (0, 0, 0.06), 0.12, 0.42, segments=16, cap=False)
    cylinder(sink, "signal_red", (0, 0, 0.48), 0.165, 0.05, segments=16)
    dome(sink, "signal_red", (0, 0, 0.53), 0.125, 0.16, segments=16)
    cylinder(sink, "plastic_white", (0, 0, 0.68), 0.03, 0.06, segments=5)
    for direction, radius, reach in (((1, 0), 0.055, 0.19), ((-1, 0), 0.055, 0.19), ((0, -1), 0.08, 0.2)):
        dx, dy = direction
        tube(sink, "signal_red", [(dx * 0.08, dy * 0.08, 0.36), (dx * reach, dy * reach, 0.36)], radius, segments=12)
        outer = [(dx * (reach - 0.01), dy * (reach - 0.01), 0.36), (dx * (reach + 0.04), dy * (reach + 0.04), 0.36)]
        tube(sink, "plastic_white", outer, radius * 1.15, segments=12, caps=True)
    return sink.parts()


def parking_meter() -> list[Part]:
    """A single-space meter: a tapered housing with a round glazed head on a post with a foot, 1.5 m high."""
    sink = Sink("parking_meter")
    for foot, radius, top, high in ((0.0, 0.11, 0.1, 0.025), (0.025, 0.06, 0.036, 0.06)):
        cylinder(sink, "galvanised", (0, 0, foot), radius, high, top_radius_m=top, segments=12, cap=radius > 0.1)
    cylinder(sink, "galvanised", (0, 0, 0.085), 0.036, 0.96, segments=10, cap=False)
    cylinder(sink, "anthracite", (0, 0, 1.0), 0.055, 0.06, top_radius_m=0.062, segments=12)
    # A housing that widens to its shoulders, and a head as round as a clock on it.
    shoulders = [(-0.055, 1.06), (0.055, 1.06), (0.1, 1.2), (0.105, 1.31), (0.09, 1.33), (-0.09, 1.33)]
    _slab(sink, "anthracite", [*shoulders, (-0.105, 1.31), (-0.1, 1.2)], 0.075)
    _slab(sink, "grey_paint", _round(0.0, 1.4, 0.105, 20), 0.06)
    _slab(sink, "plastic_grey", _round(0.0, 1.4, 0.088, 20), 0.068)
    _slab(sink, "dark_glass", _round(0.0, 1.4, 0.078, 20), 0.07)
    front = -0.0755
    for swatch, (x0, x1), (z0, z1) in (
        ("plastic_white", (-0.046, 0.046), (1.395, 1.44)),
        ("signal_red", (-0.03, 0.03), (1.345, 1.36)),
    ):
        sink.swatch_quad(swatch, [(x0, front, z0), (x1, front, z0), (x1, front, z1), (x0, front, z1)])
    for swatch, (x0, x1), (z0, z1), out in (
        ("steel", (-0.085, -0.02), (1.23, 1.31), 0.006),
        ("rubber", (-0.056, -0.049), (1.245, 1.295), 0.008),
        ("plastic_white", (0.0, 0.085), (1.23, 1.31), 0.004),
        ("signal_blue", (0.01, 0.05), (1.245, 1.295), 0.006),
        ("steel", (-0.05, 0.05), (1.1, 1.16), 0.006),
        ("rubber", (-0.038, 0.038), (1.125, 1.135), 0.008),
    ):
        sink.swatch_box(swatch, (x0, -0.075 - out, z0), (x1, -0.074, z1), skip="Y")
    tube(sink, "steel", [(0.1, 0.0, 1.26), (0.135, 0.0, 1.26)], 0.026, segments=10, caps=True)
    return sink.parts()


def letter_box(*, colour: str = "signal_yellow") -> list[Part]:
    """A pillar letter box in a palette colour, 1.25 m."""
    sink = Sink("static")
    sink.swatch_box("anthracite", (-0.22, -0.17, 0), (0.22, 0.17, 0.08), skip="z")
    sink.swatch_box(colour, (-0.25, -0.2, 0.08), (0.25, 0.2, 1.15), skip="zZ")
    angles = np.linspace(0, np.pi, 9)
    rim = [(0.25 * np.cos(a), 1.15 + 0.12 * np.sin(a)) for a in angles]
    for (x0, z0), (x1, z1) in itertools.pairwise(rim):
        sink.swatch_quad(colour, [(x0, -0.2, z0), (x0, 0.2, z0), (x1, 0.2, z1), (x1, -0.2, z1)])
    for y, order in ((-0.2, -1), (0.2, 1)):
        face = [(x, y, z) for x, z in rim]
        for second, third in itertools.pairwise(face[1:]):
            sink.swatch_quad(colour, [face[0], second, third][::-order])
    sink.swatch_box("black_paint", (-0.17, -0.204, 0.98), (0.17, -0.2, 1.03), skip="Y")
    sink.swatch_quad(
        "white_paint", [(-0.1, -0.203, 0.7), (0.1, -0.203, 0.7), (0.1, -0.203, 0.88), (-0.1, -0.203, 0.88)]
    )
    return sink.parts()


def dumpster() -> list[Part]:
    """A 1100-litre waste container with a rounded lid and castors."""
    sink = Sink("static")
    low = [(-0.6, -0.42, 0.2), (0.6, -0.42, 0.2), (0.6, 0.42, 0.2), (-0.6, 0.42, 0.2)]
    high = [(-0.68, -0.53, 1.15), (0.68, -0.53, 1.15), (0.68, 0.53, 1.15), (-0.68, 0.53, 1.15)]
    for i in range(4):
        j = (i + 1) % 4
        sink.swatch_quad("plastic_grey", [low[i], low[j], high[j], high[i]])
    sink.swatch_quad("plastic_grey", [low[3], low[2], low[1], low[0]])
    angles = np.linspace(0, np.pi, 8)
    rim = [(-0.55 * np.cos(a), 1.17 + 0.22 * np.sin(a)) for a in angles]
    for (y0, z0), (y1, z1) in itertools.pairwise(rim):
        sink.swatch_quad("dark_green", [(-0.69, y0, z0), (0.69, y0, z0), (0.69, y1, z1), (-0.69, y1, z1)])
    for x, order in ((-0.69, 1), (0.69, -1)):
        face = [(x, y, z) for y, z in rim]
        for second, third in itertools.pairwise(face[1:]):
            sink.swatch_quad("dark_green", [face[0], second, third][::order])
    sink.swatch_box("plastic_grey", (-0.7, -0.57, 1.1), (0.7, 0.57, 1.17))
    for x in (-0.5, 0.5):
        for y in (-0.32, 0.32):
            tube(sink, "rubber", [(x - 0.03, y, 0.1), (x + 0.03, y, 0.1)], 0.1, segments=10, caps=True)
            sink.swatch_box("steel", (x - 0.05, y - 0.05, 0.14), (x + 0.05, y + 0.05, 0.2), skip="zZ")
    for x in (-0.74, 0.7):
        sink.swatch_box("steel", (x, -0.06, 0.9), (x + 0.04, 0.06, 0.98))
    return sink.parts()


def cable_box(*, width_m: float = 0.8) -> list[Part]:
    """A grey cabinet of a telephone or power company, 1.1 m high."""
    sink = Sink("static")
    half = width_m / 2
    sink.swatch_box("concrete_light", (-half - 0.03, -0.19, 0), (half + 0.03, 0.19, 0.1), skip="z")
    sink.swatch_box("grey_paint", (-half, -0.16, 0.1), (half, 0.16, 1.08), skip="z")
    sink.swatch_box("grey_paint", (-half - 0.02, -0.18, 1.08), (half + 0.02, 0.18, 1.13))
    for x in (-half + 0.03, 0.01):
        sink.swatch_box("grey_paint", (x, -0.172, 0.15), (x + half - 0.04, -0.16, 1.04), skip="Y")
        for z in (0.85, 0.89, 0.93, 0.97):
            sink.swatch_box("anthracite", (x + 0.06, -0.174, z), (x + half - 0.1, -0.172, z + 0.012), skip="Y")
    sink.swatch_box("black_paint", (-0.05, -0.19, 0.55), (-0.03, -0.172, 0.68), skip="Y")
    return sink.parts()


def _round(x_m: float, z_m: float, radius_m: float, sides: int) -> list[tuple[float, float]]:
    """A circle in the plane of a front, counter-clockwise as one sees it."""
    angle = np.arange(sides) * 2 * np.pi / sides
    return [(float(x_m + radius_m * np.cos(a)), float(z_m + radius_m * np.sin(a))) for a in angle]


def _slab(sink: Sink, swatch: str, outline: list[tuple[float, float]], half_m: float) -> None:
    """A plate of a convex outline of (x, z), as seen from the front, between -half_m and half_m along y."""
    ring = np.asarray(outline)
    count = len(ring)
    fan = np.array([(0, i, i + 1) for i in range(1, count - 1)])
    for y, faces in ((-half_m, fan), (half_m, fan[:, ::-1])):
        points = np.column_stack([ring[:, 0], np.full(count, y), ring[:, 1]])
        sink.swatch_mesh(swatch, points, faces, np.tile([0.0, np.sign(y), 0.0], (count, 1)))
    for (x0, z0), (x1, z1) in itertools.pairwise([*outline, outline[0]]):
        sink.swatch_quad(swatch, [(x1, -half_m, z1), (x0, -half_m, z0), (x0, half_m, z0), (x1, half_m, z1)])
