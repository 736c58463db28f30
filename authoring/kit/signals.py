"""Traffic lights and street lamps. Signals face -y; a mast arm reaches towards -x, a lamp's arm towards -y."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, dome, ring_faces, tube, turned
from authoring.materials.atlas import lens_rect

LENS_M = 0.1
HEAD_M = (0.36, 0.24, 1.0)


def traffic_light(*, lit: str = "red", post_m: float = 2.3, pedestrian: bool = True) -> list[Part]:
    """A signal head on a post at the kerb, with a small pedestrian signal on its side.

    Args:
        lit: `red`, `amber` or `green`.
        post_m: height of the head's lower edge.
        pedestrian: whether a two-lens head for walkers hangs on the +x side.
    """
    sink = Sink("traffic_light")
    cylinder(sink, "anthracite", (0, 0, 0), 0.11, 0.5, segments=12, label="pole")
    cylinder(sink, "anthracite", (0, 0, 0.5), 0.07, post_m + 0.75, segments=12, label="pole")
    head(sink, (0.0, -0.22, post_m), lit=lit)
    for z in (post_m + 0.15, post_m + 0.85):
        sink.swatch_box("anthracite", (-0.04, -0.12, z), (0.04, 0.0, z + 0.06), label="pole")
    if pedestrian:
        lens = ["red", "dark"] if lit == "green" else ["dark", "green"]
        sink.swatch_box("black_paint", (0.1, -0.1, 2.1), (0.34, 0.1, 2.66), skip="")
        for index, name in enumerate(lens):
            _walker(sink, (0.345, 0.0, 2.52 - 0.26 * index), name)
        sink.swatch_box("anthracite", (0.0, -0.03, 2.3), (0.1, 0.03, 2.38), label="pole")
    sink.swatch_box("signal_yellow", (-0.06, -0.13, 1.05), (0.06, -0.06, 1.25), skip="", label="pole")
    return sink.parts()


def traffic_light_mast(*, arm_m: float = 6.0, lit: Sequence[str] = ("red", "red"), height_m: float = 5.6) -> list[Part]:
    """A tall mast whose arm reaches over the lanes towards -x and carries one head for each of `lit`."""
    sink = Sink("traffic_light")
    cylinder(sink, "galvanised", (0, 0, 0), 0.16, height_m + 0.4, top_radius_m=0.11, segments=14, label="pole")
    dome(sink, "galvanised", (0, 0, height_m + 0.4), 0.11, 0.05, segments=14, rings=2, label="pole")
    sink.swatch_box("galvanised", (-0.25, -0.25, 0), (0.25, 0.25, 0.06), skip="z", label="pole")
    arm = [(0, 0, height_m), (-arm_m * 0.5, 0, height_m + 0.22), (-arm_m, 0, height_m + 0.3)]
    tube(sink, "galvanised", arm, [0.1, 0.08, 0.06], segments=10, caps=True, label="pole")
    for index, name in enumerate(lit):
        x = -arm_m + 0.4 + index * min(3.2, (arm_m - 1.5) / max(1, len(lit)))
        z = height_m + 0.28 * min(1.0, -x / arm_m * 1.2) - 0.55
        head(sink, (x, -0.16, z), lit=name, backplate=True)
    head(sink, (0.0, -0.3, 2.4), lit=lit[0])
    sink.swatch_box("anthracite", (-0.04, -0.18, 2.8), (0.04, 0.0, 2.88), label="pole")
    return sink.parts()


def head(sink: Sink, foot: Sequence[float], *, lit: str, backplate: bool = False) -> None:
    """A three-lens head: housing, lenses and their visors; `foot` is the lower middle of its front's plane."""
    if lit not in ("red", "amber", "green"):
        raise ValueError(f"a signal shows red, amber or green, not {lit!r}")
    x, y, z = foot
    w, d, h = HEAD_M
    sink.swatch_box("black_paint", (x - w / 2 + 0.03, y, z), (x + w / 2 - 0.03, y + d - 0.05, z + h), skip="")
    if backplate:
        sink.swatch_box(
            "black_paint", (x - w / 2 - 0.06, y + 0.05, z - 0.12), (x + w / 2 + 0.06, y + 0.07, z + h + 0.12), skip=""
        )
    for index, name in enumerate(("green", "amber", "red")):
        centre = (x, y - 0.004, z + 0.18 + index * 0.32)
        _lens(sink, centre, name if name == lit else "dark")
        _visor(sink, centre)


def street_lamp(*, height_m: float = 8.0, arm_m: float = 1.8, style: str = "modern") -> list[Part]:
    """A lamp post: `modern` with an LED head on an arm towards -y, `double` with one to either side, `heritage`."""
    sink = Sink("pole")
    if style == "heritage":
        _heritage(sink)
        return sink.parts()
    if style not in ("modern", "double"):
        raise ValueError(f"no street lamp style named {style!r}; there are modern, double, heritage")
    cylinder(sink, "galvanised", (0, 0, 0), 0.11, 1.2, segments=12)
    cylinder(sink, "galvanised", (0, 0, 1.2), 0.085, height_m - 2.0, top_radius_m=0.06, segments=12, cap=False)
    sink.swatch_box("anthracite", (-0.06, -0.115, 0.5), (0.06, -0.09, 0.95), skip="Y")
    for sign in (-1,) if style == "modern" else (-1, 1):
        top = height_m
        bend = [
            (0, 0, top - 0.85),
            (0, 0, top - 0.4),
            (0, sign * 0.25, top - 0.12),
            (0, sign * 0.7, top),
            (0, sign * arm_m, top + 0.06),
        ]
        tube(sink, "galvanised", bend, [0.06, 0.055, 0.05, 0.045, 0.04], segments=8)
        low, high = sorted((sign * (arm_m - 0.1), sign * (arm_m + 0.65)))
        sink.swatch_box("anthracite", (-0.16, low, top + 0.0), (0.16, high, top + 0.09))
        sink.swatch_box("anthracite", (-0.1, low + 0.1, top + 0.09), (0.1, high - 0.1, top + 0.13), skip="z")
        sink.swatch_quad(
            "lamp_glass", [(x, y, top - 0.003) for x, y in ((-0.14, high), (0.14, high), (0.14, low), (-0.14, low))]
        )
    return sink.parts()


def _heritage(sink: Sink) -> None:
    post = [(0.2, 0.0), (0.2, 0.12), (0.13, 0.2), (0.12, 0.75), (0.15, 0.82), (0.07, 0.95), (0.05, 3.1), (0.09, 3.2)]
    turned(sink, "dark_green", [*post, (0.14, 3.27), (0.14, 3.33), (0.0, 3.33)], segments=14)
    turned(sink, "lamp_glass", [(0.13, 3.33), (0.2, 3.75)], segments=8)
    turned(sink, "dark_green", [(0.0, 3.73), (0.26, 3.73), (0.26, 3.76), (0.06, 3.97), (0.0, 4.1)], segments=14)
    for angle in np.arange(4) * np.pi / 2:
        x, y = np.cos(angle), np.sin(angle)
        tube(sink, "dark_green", [(x * 0.135, y * 0.135, 3.3), (x * 0.205, y * 0.205, 3.75)], 0.012, segments=5)


def _lens(sink: Sink, centre: Sequence[float], name: str) -> None:
    u0, v0, u1, v1 = lens_rect(name)
    angle = np.arange(16) * 2 * np.pi / 16
    circle = np.stack([np.cos(angle), np.sin(angle)], 1)
    points = np.stack([circle[:, 0] * LENS_M, np.zeros(16), circle[:, 1] * LENS_M], 1) + centre
    uvs = np.array([(u0 + u1) / 2, (v0 + v1) / 2]) + circle * ((u1 - u0) / 2, (v1 - v0) / 2)
    sink.polygon("lenses", points, uvs)


def _walker(sink: Sink, centre: Sequence[float], name: str) -> None:
    u0, v0, u1, v1 = lens_rect(name)
    x, y, z = centre
    half = 0.085
    corners = [(x, y - half, z - half), (x, y + half, z - half), (x, y + half, z + half), (x, y - half, z + half)]
    sink.polygon("lenses", corners, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)])


def _visor(sink: Sink, centre: Sequence[float]) -> None:
    """Adds a hood around the upper three quarters of a lens, with its inner and outer faces."""
    angle = np.radians(np.linspace(-35, 215, 11))
    circle = np.stack([np.cos(angle), np.zeros(11), np.sin(angle)], 1)
    rear = circle * (LENS_M + 0.015) + centre
    reach = 0.1 + 0.1 * np.clip(np.sin(angle), 0, 1)
    front = rear + np.stack([np.zeros(11), -reach, np.zeros(11)], 1)
    points = np.stack([rear, front]).reshape(-1, 3)
    faces = [f for f in ring_faces(2, 11).tolist() if max(c % 11 for c in f) - min(c % 11 for c in f) <= 1]
    normals = np.concatenate([circle, circle])
    sink.swatch_mesh("black_paint", points, [f[::-1] for f in faces], normals)
    sink.swatch_mesh("black_paint", points, faces, -normals)
