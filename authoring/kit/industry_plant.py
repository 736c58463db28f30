"""Industrial plant: silos, tanks, chimneys, pylons, cranes of a container terminal."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, disc, dome, tube

Array = npt.NDArray[np.float64]


def silos(count: int, *, radius_m: float = 3.0, height_m: float = 18.0) -> list[Part]:
    """A row of steel silos along x with a gallery on top and a conveyor tower at its end."""
    sink = Sink("building")
    pitch = 2 * radius_m + 0.4
    first = -(count - 1) * pitch / 2
    for index in range(count):
        x = first + index * pitch
        cylinder(sink, "aluminium", (x, 0, 0), radius_m, height_m, segments=20, cap=False)
        for z in np.arange(1.5, height_m, 1.5):
            cylinder(sink, "galvanised", (x, 0, z), radius_m + 0.04, 0.1, segments=20, cap=False)
        disc(sink, "galvanised", (x, 0, height_m), radius_m + 0.05, segments=20, is_underside=True)
        dome(sink, "galvanised", (x, 0, height_m), radius_m + 0.05, 1.6, segments=20, rings=1)
        _ladder(sink, x, -radius_m - 0.25, height_m)
    end = first + (count - 1) * pitch + radius_m + 1.5
    top = height_m + 1.7
    sink.swatch_box("zinc_roof", (first - 1, -1.0, top), (end, 1.0, top + 2.2))
    for x0 in np.arange(end - 1.2, end + 1.3, 2.4):
        for y in (-1.2, 1.2):
            sink.swatch_box("galvanised", (x0 - 0.12, y - 0.12, 0), (x0 + 0.12, y + 0.12, top + 3), skip="zZ")
    for z in np.arange(3.0, top + 2, 3.0):
        sink.swatch_box("galvanised", (end - 1.3, -1.3, z), (end + 1.3, 1.3, z + 0.15))
    sink.swatch_box("zinc_roof", (end - 1.6, -1.6, top), (end + 1.6, 1.6, top + 3.4))
    return sink.parts()


def tank(radius_m: float, height_m: float, *, swatch: str = "white_paint") -> list[Part]:
    """A storage tank with a shallow cone, a spiral stair and a rail."""
    sink = Sink("building")
    cylinder(sink, swatch, (0, 0, 0), radius_m, height_m, segments=32, cap=False)
    dome(sink, swatch, (0, 0, height_m), radius_m, 0.1 * radius_m, segments=32, rings=1)
    for z in np.arange(2.0, height_m, 2.0):
        cylinder(sink, "grey_paint", (0, 0, z), radius_m + 0.02, 0.05, segments=32, cap=False)
    steps = int(height_m / 0.5)
    for step in range(steps):
        a = -np.pi / 2 + step * 0.5 * 1.1 / radius_m
        c, s = np.cos(a), np.sin(a)
        x, y, z = c * (radius_m + 0.5), s * (radius_m + 0.5), step * 0.5
        sink.swatch_box("galvanised", (x - 0.35, y - 0.35, z + 0.35), (x + 0.35, y + 0.35, z + 0.42))
    angles = np.linspace(0, 2 * np.pi, 33)
    ring = np.stack([np.cos(angles) * radius_m, np.sin(angles) * radius_m, np.full(33, height_m + 1.0)], 1)
    tube(sink, "galvanised", ring, 0.04, segments=4)
    for a in angles[:-1:2]:
        x, y = np.cos(a) * radius_m, np.sin(a) * radius_m
        sink.swatch_box("galvanised", (x - 0.03, y - 0.03, height_m), (x + 0.03, y + 0.03, height_m + 1), skip="zZ")
    return sink.parts()


def chimney(height_m: float) -> list[Part]:
    """A concrete chimney with red and white bands."""
    sink = Sink("building")
    low, high = height_m * 0.05, height_m * 0.028
    bands = 8
    for index in range(bands):
        z0, z1 = height_m * index / bands, height_m * (index + 1) / bands
        r0, r1 = (low + (high - low) * z / height_m for z in (z0, z1))
        swatch = "concrete_light" if index < 4 else ("signal_red", "white_paint")[index % 2]
        cylinder(sink, swatch, (0, 0, z0), r0, z1 - z0, top_radius_m=r1, segments=20, cap=index == bands - 1)
    return sink.parts()


def pylon(height_m: float = 34.0) -> list[Part]:
    """A lattice pylon with three pairs of arms along x."""
    sink = Sink("pole")
    levels = np.linspace(0, height_m, 9)
    half = np.interp(levels, [0, height_m * 0.6, height_m], [height_m * 0.09, height_m * 0.035, 0.25])
    corners = [np.array([sx * half, sy * half, levels]).T for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for corner in corners:
        for a, b in itertools.pairwise(corner):
            strut(sink, a, b, 0.11)
    for index, (first, second) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        for level in range(len(levels) - 1):
            ends = (first[level], second[level + 1]) if (level + index) % 2 else (second[level], first[level + 1])
            strut(sink, *ends, 0.06)
            strut(sink, first[level + 1], second[level + 1], 0.05)
    for z, reach in ((height_m * 0.66, 6.5), (height_m * 0.8, 7.5), (height_m * 0.93, 5.0)):
        for side in (-1, 1):
            tip = np.array([side * reach, 0.0, z])
            for y in (-0.7, 0.7):
                strut(sink, np.array([side * 0.7, y, z]), tip, 0.07)
            strut(sink, np.array([side * 0.5, 0.0, z + 1.6]), tip, 0.06)
            strut(sink, tip, tip - (0, 0, 1.6), 0.09)
    return sink.parts()


def wires(spans: list[tuple[Array, Array]], *, sag_m: float = 3.5) -> list[Part]:
    """Makes power lines that sag between pairs of points (3,)."""
    sink = Sink("pole")
    for start, end in spans:
        share = np.linspace(0, 1, 9)[:, None]
        line = start + share * (end - start) - np.array([0, 0, 4 * sag_m]) * share * (1 - share)
        for a, b in itertools.pairwise(line):
            strut(sink, a, b, 0.035)
    return sink.parts()


def quay_crane(height_m: float = 62.0, *, swatch: str = "signal_blue", raised: bool = False) -> list[Part]:
    """A ship-to-shore crane: portal legs, a boom over the water (towards -y) or raised, a cabin and stays."""
    sink = Sink("static")
    deck = height_m * 0.6
    for x in (-9.0, 9.0):
        for y in (-13.0, 13.0):
            strut(sink, np.array([x, y, 0.0]), np.array([x * 0.9, y, deck + 4]), 1.1, swatch)
        strut(sink, np.array([x, -13.0, 13.0]), np.array([x, 13.0, 13.0]), 1.2, swatch)
        strut(sink, np.array([x, -13.0, 13.5]), np.array([x * 0.9, 13.0, deck]), 0.6, swatch)
        strut(sink, np.array([x * 0.9, -13.0, deck]), np.array([0.0, -12.0, height_m]), 0.7, swatch)
    for y in (-13.0, 13.0):
        strut(sink, np.array([-9.0, y, deck]), np.array([9.0, y, deck]), 1.3, swatch)
        strut(sink, np.array([-9.0, y, 13.0]), np.array([9.0, y, 13.0]), 1.0, swatch)
    hinge = np.array([0.0, -15.0, deck + 3.0])
    tip = hinge + (np.array([0, -12.0, height_m * 0.78]) if raised else np.array([0, -45.0, 0.0]))
    for x in (-2.5, 2.5):
        side = np.array([x, 0.0, 0.0])
        strut(sink, hinge + side, tip + side, 1.2, swatch)
        strut(sink, hinge + side, np.array([x, 32.0, deck + 3.0]), 1.2, swatch)
        strut(sink, np.array([0.0, -12.0, height_m]), tip + side * 0.5, 0.3, swatch)
        strut(sink, np.array([0.0, -12.0, height_m]), np.array([x, 30.0, deck + 3.0]), 0.3, swatch)
    for share in np.linspace(0.1, 1, 7):
        middle = hinge + (tip - hinge) * share
        side = np.array([2.5, 0.0, 0.0])
        strut(sink, middle - side, middle + side, 0.5, swatch)
    sink.swatch_box("white_paint", (-3.5, 12.0, deck + 3.6), (3.5, 24.0, deck + 9.0))
    sink.swatch_box("dark_glass", (3.2, -20.0, deck - 2.5), (5.6, -17.0, deck + 0.5))
    return sink.parts()


def strut(sink: Sink, start: Array, end: Array, thick_m: float, swatch: str = "galvanised") -> None:
    """Adds a square bar with open ends between two points (3,)."""
    along = (end - start) / np.linalg.norm(end - start)
    side = np.cross(along, (0.0, 0.0, 1.0))
    if np.linalg.norm(side) < 1e-3:
        side = np.array([1.0, 0.0, 0.0])
    side = side / np.linalg.norm(side)
    up = np.cross(side, along)
    corners = [(side * a + up * b) * thick_m / 2 for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    for first, second in zip(corners, corners[1:] + corners[:1], strict=True):
        sink.swatch_quad(swatch, [start + first, start + second, end + second, end + first][::-1])


def _ladder(sink: Sink, x: float, y: float, height_m: float) -> None:
    for side in (-0.25, 0.25):
        sink.swatch_box("steel", (x + side - 0.02, y - 0.02, 0.5), (x + side + 0.02, y + 0.02, height_m), skip="zZ")
    for z in np.arange(0.8, height_m, 0.8):
        sink.swatch_box("steel", (x - 0.25, y - 0.015, z), (x + 0.25, y + 0.015, z + 0.03), skip="xX")
