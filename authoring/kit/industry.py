"""Industrial buildings: warehouses with loading docks, sheds, a petrol station. Fronts face -y."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder
from authoring.materials import MATERIALS
from authoring.materials.atlas import FASCIA_COUNT, door_rect, fascia_rect, shop_rect

Array = npt.NDArray[np.float64]
DOCK_PITCH_M = 6.0
DOCK_FLOOR_M = 1.15
PARAPET_M = 0.9
FRAMES_M = 0.16


def warehouse(
    width_m: float, depth_m: float, height_m: float, rng: np.random.Generator, *, cladding: str = "cladding_white"
) -> list[Part]:
    """A flat-roofed warehouse: clad walls over a concrete base, dock doors along its front, an office at one end.

    Args:
        width_m, depth_m: size of the footprint in metres, at least 30 by 15.
        height_m: height of the parapet in metres, at least 7.
        rng: random generator of the details.
        cladding: material of the walls.
    """
    sink = Sink("building")
    x, y = width_m / 2, depth_m / 2
    tile = MATERIALS[cladding].tile_m
    sink.tiled_box("concrete", (-x, -y, 0), (x, y, 1.3), tile_m=4.0, skip="zZ")
    sink.tiled_box(cladding, (-x, -y, 1.3), (x, y, height_m), tile_m=tile, skip="zZ")
    trim = str(rng.choice(["dark_blue", "dark_red", "anthracite", "teal_paint", "orange"]))
    _rim(sink, trim, x + 0.06, y + 0.06, height_m - 0.15, height_m + 0.12)
    sink.quad("roof_gravel", [(-x, -y, height_m - 0.1), (x, -y, height_m - 0.1), (x, y, height_m - 0.1),
                              (-x, y, height_m - 0.1)], tile_m=2.0)  # fmt: skip
    sink.swatch_box(trim, (-x - 0.03, -y - 0.03, height_m - 2.2), (x + 0.03, y + 0.03, height_m - 1.5), skip="zZ")
    office_m = min(16.0, width_m * 0.3)
    _docks(sink, -x + 1.0, x - office_m - 1.0, -y)
    _office(sink, x - office_m, x - 0.4, -y, height_m - 2.6)
    _fascia(sink, int(rng.integers(FASCIA_COUNT)), -x + width_m * 0.3, -y - 0.08, height_m - 4.2, 9.0)
    for side in (-1.0, 1.0):
        for v in np.arange(-y + 4, y - 2, 7.0):
            _side_window(sink, side * x, float(v), height_m - 3.2)
        for v in (-y + 0.4, y - 0.4):
            cylinder(sink, "zinc_roof", (side * (x + 0.08), v, 0), 0.07, height_m - 0.2, segments=6, cap=False)
    for _ in range(int(width_m * depth_m / 220)):
        u, v = rng.uniform(-x + 4, x - 4), rng.uniform(-y + 3, y - 3)
        sink.swatch_box("galvanised", (u - 1.0, v - 0.8, height_m - 0.1), (u + 1.0, v + 0.8, height_m + 1.0), skip="z")
    return sink.parts()


def shed(
    width_m: float, depth_m: float, eaves_m: float, rng: np.random.Generator, *, cladding: str = "metal_panel"
) -> list[Part]:
    """A workshop with a shallow gable along x, roller doors in front and rooflights."""
    sink = Sink("building")
    x, y = width_m / 2, depth_m / 2
    ridge = eaves_m + 0.16 * depth_m
    tile = MATERIALS[cladding].tile_m
    sink.tiled_box("brick_brown", (-x, -y, 0), (x, y, 1.0), tile_m=2.0, skip="zZ")
    sink.tiled_box(cladding, (-x, -y, 1.0), (x, y, eaves_m), tile_m=tile, skip="zZ")
    for side in (-1.0, 1.0):
        gable = [(side * x, -side * -y, eaves_m), (side * x, side * y, eaves_m), (side * x, 0.0, ridge)]
        corners = np.array([(side * x, -side * y, eaves_m), gable[1], gable[2]])
        sink.polygon(cladding, corners, np.stack([corners[:, 1], corners[:, 2]], 1) / tile)
    over = 0.4
    drop = over * (ridge - eaves_m) / y
    for side in (-1.0, 1.0):
        low, high = (side * (y + over), eaves_m - drop), (0.0, ridge + 0.02)
        roof = np.array([(-x - 0.3, *low), (x + 0.3, *low), (x + 0.3, *high), (-x - 0.3, *high)])
        under = roof - (0.0, 0.0, 0.12)
        if side > 0:
            roof, under = roof[[1, 0, 3, 2]], under[[1, 0, 3, 2]]
        sink.quad("metal_panel", roof, tile_m=2.0)
        sink.swatch_quad("zinc_roof", under[::-1])
        sink.swatch_quad("zinc_roof", [under[0], under[1], roof[1], roof[0]])
        for a, b in ((1, 2), (3, 0)):
            sink.swatch_quad("zinc_roof", [under[a], under[b], roof[b], roof[a]])
        for u in np.arange(-x + 4, x - 3, 6.0):
            t0, t1 = 0.3, 0.75
            light = [(u + du, low[0] * (1 - t), low[1] * (1 - t) + high[1] * t + 0.03)
                     for du, t in ((-0.6, t0), (0.6, t0), (0.6, t1), (-0.6, t1))]  # fmt: skip
            sink.swatch_quad("plastic_white", light if side < 0 else light[::-1])
    doors = max(1, int((width_m - 4) // 7.5))
    for index in range(doors):
        u = -x + 3.5 + (index + 0.5) * (width_m - 7) / doors
        top_m = min(4.2, eaves_m - 0.6)
        _door(sink, u - 2.1, u + 2.1, 0.0, top_m, -y, str(rng.choice(["signal_blue", "dark_green", "galvanised"])))
    _picture(sink, "shop_fronts", door_rect("steel"), x - 2.2, x - 1.2, 0.0, 2.1, -y - 0.03)
    _fascia(sink, int(rng.integers(FASCIA_COUNT)), -x * 0.1, -y - 0.1, eaves_m - 0.55, min(7.0, width_m * 0.4))
    return sink.parts()


def petrol_station(rng: np.random.Generator) -> list[Part]:
    """A canopy of 22 m by 11 m on four columns over two islands of pumps; its drive runs along x."""
    sink = Sink("building")
    low, high = 4.7, 5.6
    sink.swatch_box("plastic_white", (-11, -5.5, low), (11, 5.5, high))
    sink.swatch_box("signal_green", (-11.04, -5.54, low + 0.25), (11.04, 5.54, low + 0.6), skip="zZ")
    for u in np.arange(-9.0, 9.1, 3.6):
        for v in (-2.6, 2.6):
            light = [(u + a * 0.4, v - b * 0.25, low - 0.01) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            sink.swatch_quad("lamp_glass", light)
    _fascia(sink, int(rng.integers(FASCIA_COUNT)), 0.0, -5.56, low + 0.1, 5.6)
    for v in (-2.6, 2.6):
        for u in (-7.5, 7.5):
            sink.swatch_box("galvanised", (u - 0.2, v - 0.2, 0), (u + 0.2, v + 0.2, low), skip="zZ", label="pole")
        for u in (-4.0, 0.0, 4.0):
            sink.tiled_box(
                "concrete", (u - 1.5, v - 0.55, 0), (u + 1.5, v + 0.55, 0.14), tile_m=4, skip="z", label="static"
            )
            sink.swatch_box(
                "plastic_white", (u - 0.5, v - 0.3, 0.14), (u + 0.5, v + 0.3, 1.55), skip="z", label="static"
            )
            sink.swatch_box("signal_green", (u - 0.52, v - 0.32, 1.55), (u + 0.52, v + 0.32, 2.0), label="static")
            for face in (-1.0, 1.0):
                near = sorted((v + face * 0.3, v + face * 0.33))
                sink.swatch_box("dark_glass", (u - 0.35, near[0], 1.0), (u + 0.35, near[1], 1.4), label="static")
                for side in (-0.3, 0.3):
                    near = sorted((v + face * 0.3, v + face * 0.42))
                    sink.swatch_box(
                        "rubber", (u + side - 0.05, near[0], 0.6), (u + side + 0.05, near[1], 0.95), label="static"
                    )
    return sink.parts()


def kiosk(rng: np.random.Generator) -> list[Part]:
    """The shop of a petrol station, 16 m by 9 m, glazed in front."""
    sink = Sink("building")
    sink.swatch_box("plastic_white", (-8, -4.5, 0), (8, 4.5, 3.9), skip="zZ")
    sink.quad("roof_gravel", [(-8, -4.5, 3.85), (8, -4.5, 3.85), (8, 4.5, 3.85), (-8, 4.5, 3.85)], tile_m=2.0)
    _rim(sink, "signal_green", 8.1, 4.6, 3.35, 3.95)
    for index, u in enumerate((-6.0, -3.0, 0.0, 3.0, 6.0)):
        rect = door_rect("glass_double") if index == 2 else shop_rect(int(rng.integers(4)))
        _picture(sink, "shop_fronts", rect, u - 1.4, u + 1.4, 0.05, 2.9, -4.53)
    _fascia(sink, int(rng.integers(FASCIA_COUNT)), 0.0, -4.65, 3.32, 5.0)
    return sink.parts()


def price_mast() -> list[Part]:
    """A petrol station's tall price board."""
    sink = Sink("static")
    for x in (-0.9, 0.9):
        sink.swatch_box("galvanised", (x - 0.1, -0.1, 0), (x + 0.1, 0.1, 6.6), skip="z", label="pole")
    sink.swatch_box("signal_green", (-1.2, -0.18, 4.9), (1.2, 0.18, 6.7))
    for row in range(4):
        sink.swatch_box("black_paint", (-1.1, -0.16, 2.2 + row * 0.66), (1.1, 0.16, 2.78 + row * 0.66))
        for face in (-0.17, 0.17):
            digits = [(-0.2, 0.0), (0.2, 0.0), (0.6, 0.0)]
            for u, _ in digits:
                low, high = sorted((face, face * 1.06))
                sink.swatch_box("signal_yellow", (u, low, 2.3 + row * 0.66), (u + 0.24, high, 2.68 + row * 0.66))
    return sink.parts()


def _docks(sink: Sink, x0: float, x1: float, front: float) -> None:
    """Adds dock doors with rubber seals, bumpers and numbers, steps at one end and a canopy above."""
    count = max(1, int((x1 - x0) // DOCK_PITCH_M))
    for index in range(count):
        u = x0 + (index + 0.5) * (x1 - x0) / count
        low, high = DOCK_FLOOR_M, DOCK_FLOOR_M + 3.0
        sink.swatch_box("rubber", (u - 1.75, front - 0.55, low - 0.1), (u - 1.3, front, high + 0.4), skip="Y")
        sink.swatch_box("rubber", (u + 1.3, front - 0.55, low - 0.1), (u + 1.75, front, high + 0.4), skip="Y")
        sink.swatch_box("rubber", (u - 1.3, front - 0.55, high - 0.1), (u + 1.3, front, high + 0.4), skip="YxX")
        _picture(sink, "shop_fronts", door_rect("shutter"), u - 1.3, u + 1.3, low, high, front - 0.03)
        sink.swatch_box("steel", (u - 1.1, front - 0.3, low - 0.16), (u + 1.1, front, low), skip="Y")
        for v in (-1.0, 0.7):
            sink.swatch_box("signal_yellow", (u + v, front - 0.26, 0.35), (u + v + 0.3, front, 1.0), skip="Y")
        sink.swatch_box("signal_yellow", (u - 0.4, front - 0.05, high + 0.6), (u + 0.4, front, high + 1.2), skip="Y")
    sink.swatch_box("zinc_roof", (x0, front - 2.2, DOCK_FLOOR_M + 4.55), (x1, front, DOCK_FLOOR_M + 4.75), skip="Y")
    for u in np.linspace(x0 + 0.2, x1 - 0.2, count + 1):
        sink.swatch_box(
            "galvanised", (u - 0.05, front - 2.1, DOCK_FLOOR_M + 4.75), (u + 0.05, front, DOCK_FLOOR_M + 4.85)
        )


def _office(sink: Sink, x0: float, x1: float, front: float, top: float) -> None:
    """Adds an office: two rows of windows in a projecting box, and a door under a slab."""
    sink.tiled_box("brick_brown", (x0, front - 1.5, 0), (x1, front, top), tile_m=2.0, skip="zY")
    face = front - 1.53
    count = max(2, int((x1 - x0) // 2.6))
    for row in range(max(1, int(top // 3.2))):
        for index in range(count):
            u = x0 + (index + 0.5) * (x1 - x0) / count
            low = 0.9 + row * 3.2
            if row == 0 and index == count // 2:
                _picture(sink, "shop_fronts", door_rect("glass_double"), u - 0.9, u + 0.9, 0.0, 2.4, face)
                sink.swatch_box("anthracite", (u - 1.5, face - 1.3, 2.6), (u + 1.5, face + 0.03, 2.8))
                continue
            sink.swatch_box(
                "white_paint", (u - 0.98, face - 0.02, low - 0.08), (u + 0.98, face + 0.03, low + 1.58), skip="Y"
            )
            pane = [(u + a * 0.9, face - 0.03, low + b * 1.5) for a, b in ((-1, 0), (1, 0), (1, 1), (-1, 1))]
            sink.swatch_quad("grey_glass", pane)


def _side_window(sink: Sink, x: float, y: float, top: float) -> None:
    side = 1.0 if x > 0 else -1.0
    near = sorted((x, x + side * 0.04))
    sink.swatch_box("anthracite", (near[0], y - 1.6, top - 1.2), (near[1], y + 1.6, top), skip="X" if side < 0 else "x")
    face = [(x + side * 0.05, y + side * a * 1.5, top + b) for a, b in ((-1, -1.1), (1, -1.1), (1, -0.1), (-1, -0.1))]
    sink.swatch_quad("grey_glass", face)


def _door(sink: Sink, x0: float, x1: float, low: float, high: float, front: float, frame: str) -> None:
    sink.swatch_box(frame, (x0 - 0.2, front - FRAMES_M, low), (x0, front, high + 0.25), skip="Yz")
    sink.swatch_box(frame, (x1, front - FRAMES_M, low), (x1 + 0.2, front, high + 0.25), skip="Yz")
    sink.swatch_box(frame, (x0, front - FRAMES_M, high), (x1, front, high + 0.25), skip="YxX")
    _picture(sink, "shop_fronts", door_rect("shutter"), x0, x1, low, high, front - 0.03)


def _picture(
    sink: Sink, material: str, rect: Sequence[float], x0: float, x1: float, z0: float, z1: float, y: float
) -> None:
    """Adds a cell of an atlas as an upright rectangle at y that faces -y."""
    u0, v0, u1, v1 = rect
    sink.polygon(
        material, [(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)], [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]
    )


def _fascia(sink: Sink, index: int, x: float, y: float, z: float, width_m: float) -> None:
    high = width_m / 8
    sink.swatch_box("anthracite", (x - width_m / 2 - 0.05, y - 0.02, z - 0.05),
                    (x + width_m / 2 + 0.05, y + 0.1, z + high + 0.05))  # fmt: skip
    _picture(sink, "signs", fascia_rect(index), x - width_m / 2, x + width_m / 2, z, z + high, y - 0.03)


def _rim(sink: Sink, swatch: str, x: float, y: float, low: float, high: float) -> None:
    """Adds a parapet around a roof, with its outer, upper and inner faces."""
    sink.swatch_box(swatch, (-x, -y, low), (x, y, high), skip="zZ")
    wide = 0.25
    sink.swatch_box(swatch, (-x, -y, high - 0.02), (x, -y + wide, high), skip="z")
    sink.swatch_box(swatch, (-x, y - wide, high - 0.02), (x, y, high), skip="z")
    sink.swatch_box(swatch, (-x, -y + wide, high - 0.02), (-x + wide, y - wide, high), skip="zyY")
    sink.swatch_box(swatch, (x - wide, -y + wide, high - 0.02), (x, y - wide, high), skip="zyY")
