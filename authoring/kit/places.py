"""Larger furniture: bus stop, advertising pillar, cafe terrace, and the flat covers in a road."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, disc, dome, tube, turned
from authoring.kit.signs import OUTLINES
from authoring.materials.atlas import ironwork_rect, poster_rect, traffic_sign_rect


def bus_stop(rng: np.random.Generator) -> list[Part]:
    """A shelter 4 m long, open towards -y, with a bench and a lit poster; its glass is tinted, never see-through."""
    sink = Sink("static")
    for x in (-1.9, 0.0, 1.9):
        sink.swatch_box("anthracite", (x - 0.04, 0.62, 0), (x + 0.04, 0.7, 2.4), skip="z")
    for x in (-1.9, 1.9):
        sink.swatch_box("anthracite", (x - 0.04, -0.5, 2.3), (x + 0.04, 0.62, 2.4), skip="")
    sink.swatch_box("anthracite", (-2.1, -0.8, 2.4), (2.1, 0.8, 2.52))
    sink.swatch_box("grey_glass", (-2.0, -0.7, 2.52), (2.0, 0.7, 2.54), skip="z")
    for x0, x1 in ((-1.86, -0.04), (0.04, 1.86)):
        sink.swatch_box("grey_glass", (x0, 0.65, 0.25), (x1, 0.67, 2.15), skip="xX")
        for z in (0.2, 2.15):
            sink.swatch_box("anthracite", (x0, 0.64, z), (x1, 0.68, z + 0.05), skip="xX")
    sink.swatch_box("anthracite", (-1.98, -0.65, 0.12), (-1.82, 0.6, 2.15), skip="z")
    poster = poster_rect(int(rng.integers(4)))
    for x, order in ((-1.815, 1), (-1.985, -1)):
        y = (-0.58, 0.53)[::order]
        corners = [(x, y[0], 0.35), (x, y[1], 0.35), (x, y[1], 2.02), (x, y[0], 2.02)]
        sink.polygon(
            "signs",
            corners,
            [(poster[0], poster[1]), (poster[2], poster[1]), (poster[2], poster[3]), (poster[0], poster[3])],
        )
    sink.swatch_box("teak", (-1.3, 0.22, 0.44), (1.3, 0.56, 0.49), label="static")
    for x in (-1.0, 1.0):
        sink.swatch_box("steel", (x - 0.03, 0.3, 0), (x + 0.03, 0.5, 0.44), skip="zZ")
    cylinder(sink, "galvanised", (2.6, -0.4, 0), 0.035, 2.9, segments=10, label="pole")
    _flag(sink, (2.6, -0.44, 2.55))
    return sink.parts()


def advertising_pillar(rng: np.random.Generator) -> list[Part]:
    """A round pillar with posters, 1.3 m across and 3.4 m high."""
    sink = Sink("static")
    cylinder(sink, "concrete_dark", (0, 0, 0), 0.7, 0.35, segments=24)
    count, sides = 4, 24
    step = 2 * np.pi / sides
    shift = int(rng.integers(4))
    for index in range(sides):
        a, b = index * step, (index + 1) * step
        rect = poster_rect(index // (sides // count) + shift)
        share = (index % (sides // count)) / (sides // count)
        du = rect[2] - rect[0]
        u0, u1 = rect[0] + share * du, rect[0] + (share + count / sides) * du
        corners = [
            (0.64 * np.cos(a), 0.64 * np.sin(a), 0.4),
            (0.64 * np.cos(b), 0.64 * np.sin(b), 0.4),
            (0.64 * np.cos(b), 0.64 * np.sin(b), 2.7),
            (0.64 * np.cos(a), 0.64 * np.sin(a), 2.7),
        ]
        sink.polygon("signs", corners, [(u0, rect[1]), (u1, rect[1]), (u1, rect[3]), (u0, rect[3])])
    turned(sink, "dark_green", [(0.68, 0.35), (0.68, 0.41), (0.64, 0.41)], segments=24)
    crown = [(0.64, 2.7), (0.68, 2.7), (0.68, 2.8), (0.62, 2.82), (0.74, 3.0), (0.0, 3.0)]
    turned(sink, "dark_green", crown, segments=24)
    dome(sink, "copper_green", (0, 0, 3.0), 0.74, 0.45, segments=24)
    cylinder(sink, "dark_green", (0, 0, 3.44), 0.05, 0.2, segments=8)
    return sink.parts()


def cafe(rng: np.random.Generator, *, parasol: bool = True) -> list[Part]:
    """A round table with two to four chairs, under a parasol."""
    sink = Sink("static")
    cylinder(sink, "anthracite", (0, 0, 0), 0.22, 0.03, segments=14)
    cylinder(sink, "anthracite", (0, 0, 0.03), 0.03, 0.67, segments=8, cap=False)
    cylinder(sink, "aluminium", (0, 0, 0.7), 0.36, 0.03, segments=20)
    for index in range(int(rng.integers(2, 5))):
        angle = index * np.pi / 2 + float(rng.uniform(-0.3, 0.3))
        _chair(sink, 0.62 * np.cos(angle), 0.62 * np.sin(angle), angle)
    if parasol:
        canvas = str(rng.choice(["canvas_white", "canvas_red", "canvas_green", "canvas_sand"]))
        cylinder(sink, "weathered_wood", (0, 0, 0.73), 0.022, 1.75, segments=8, cap=False)
        sides, radius = 8, 1.35
        angle_at = np.arange(sides + 1) * 2 * np.pi / sides
        tip = (0.0, 0.0, 2.6)
        for a, b in itertools.pairwise(angle_at):
            p = (radius * np.cos(a), radius * np.sin(a), 2.15)
            q = (radius * np.cos(b), radius * np.sin(b), 2.15)
            sink.swatch_quad(canvas, [p, q, tip])
            sink.swatch_quad(canvas, [q, p, tip])
            low_p, low_q = (p[0], p[1], 1.97), (q[0], q[1], 1.97)
            sink.swatch_quad(canvas, [low_p, low_q, q, p])
            sink.swatch_quad(canvas, [low_p, p, q, low_q])
    return sink.parts()


def road_cover(kind: str) -> list[Part]:
    """A flat iron cover to lie on a road or pavement, 2 mm proud: manhole, manhole_square, drain, tree_grate."""
    size = {"manhole": 0.66, "manhole_square": 0.7, "drain": 0.5, "tree_grate": 1.4}
    if kind not in size:
        raise ValueError(f"no road cover named {kind!r}; there are {', '.join(size)}")
    half = size[kind] / 2
    u0, v0, u1, v1 = ironwork_rect(kind)
    sides = 20 if kind == "manhole" else 4
    angle = np.arange(sides) * 2 * np.pi / sides + (0 if sides > 4 else np.pi / 4)
    circle = np.stack([np.cos(angle), np.sin(angle)], 1) * (1 if sides > 4 else np.sqrt(2)) * 0.995
    uvs = np.array([(u0 + u1) / 2, (v0 + v1) / 2]) + circle * ((u1 - u0) / 2, (v1 - v0) / 2)
    sink = Sink("sidewalk" if kind == "tree_grate" else "road")
    sink.polygon("ironwork", np.column_stack([circle * half, np.full(sides, 0.002)]), uvs)
    return sink.parts()


def power_pole(height_m: float = 8.5) -> list[Part]:
    """A wooden pole with two cross-arms and insulators along x, and a transformer."""
    sink = Sink("pole")
    cylinder(sink, "weathered_wood", (0, 0, 0), 0.15, height_m, top_radius_m=0.1, segments=12)
    for z in (height_m - 0.5, height_m - 1.3):
        sink.swatch_box("weathered_wood", (-1.1, -0.17, z), (1.1, -0.08, z + 0.11))
        for x in (-1.0, -0.5, 0.5, 1.0):
            cylinder(sink, "brown_paint", (x, -0.125, z + 0.11), 0.035, 0.13, top_radius_m=0.025, segments=8)
    drum = [(0, 0.38, height_m - 3.0), (0, 0.38, height_m - 2.15)]
    tube(sink, "galvanised", drum, 0.24, segments=14, caps=True)
    disc(sink, "anthracite", (0, 0.38, height_m - 2.14), 0.2, segments=14)
    sink.swatch_box("galvanised", (-0.08, 0.1, height_m - 2.5), (0.08, 0.2, height_m - 2.35))
    return sink.parts()


def _flag(sink: Sink, centre: tuple[float, float, float]) -> None:
    outline, half_m = OUTLINES["bus_stop"]
    u0, v0, u1, v1 = traffic_sign_rect("bus_stop")
    uvs = np.array([(u0 + u1) / 2, (v0 + v1) / 2]) + outline * ((u1 - u0) / 2, (v1 - v0) / 2)
    x, y, z = centre
    for depth, flip in ((0.0, 1), (0.02, -1)):
        points = np.column_stack(
            [outline[:, 0] * half_m * 0.8 * flip + x, np.full(4, y + depth), outline[:, 1] * half_m * 0.8 + z]
        )
        sink.polygon("traffic_signs", points, uvs, label="traffic_sign")


def _chair(sink: Sink, x: float, y: float, angle: float) -> None:
    out, side = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    centre = np.array([x, y])
    corners = [centre + out * a * 0.2 + side * b * 0.2 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    seat = [(*p, 0.46) for p in corners]
    sink.swatch_quad("oak", seat)
    sink.swatch_quad("oak", [seat[0], seat[3], seat[2], seat[1]])
    for corner in corners:
        tube(sink, "anthracite", [(*corner, 0), (*corner, 0.45)], 0.012, segments=4)
    back = [centre + out * 0.21 + side * b * 0.2 for b in (-1, 1)]
    for b in back:
        tube(sink, "anthracite", [(*b, 0.45), (*(b + out * 0.06), 0.85)], 0.012, segments=4)
    low, high = [(*b, 0.62) for b in back], [(*(b + out * 0.05), 0.82) for b in back]
    panel = [low[0], low[1], high[1], high[0]]
    sink.swatch_quad("oak", panel)
    sink.swatch_quad("oak", [panel[0], panel[3], panel[2], panel[1]])
