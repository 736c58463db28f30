"""The motorcycles: a naked standard one, and a scooter with a box."""

from __future__ import annotations

import numpy as np

from authoring.mesh import merge, rotation
from authoring.people.field import Field, blend, cut, ellipsoid, loft, rounded_box
from authoring.people.piece import Piece
from authoring.two_wheelers.machine import COLOURS
from authoring.two_wheelers.parts import ALONG_X, Hard, arch, block, cast_spokes, curve, disc, rim_ring, tube, tyre

_TURN_Y = rotation("y", 90.0)


def _wheel(hard: Hard, centre: tuple[float, float, float], radius: float, width: float, spokes: int) -> None:
    rim = radius - 0.085 if radius > 0.28 else radius - 0.075
    hard.add("trim", "rubber", tyre(centre, radius, width, rim), crease_deg=50.0)
    hard.add("metal", "grey", rim_ring(centre, rim, width * 0.72, 0.022))
    hard.add("metal", "grey", cast_spokes(centre, rim - 0.015, 0.035, spokes))
    hard.add("metal", "silver", disc(centre, [(0.0, -0.07), (0.032, -0.07), (0.032, 0.07), (0.0, 0.07)], 14))


def _brake(hard: Hard, centre: tuple[float, float, float], y: float, radius: float) -> None:
    middle = (centre[0], centre[1] + y, centre[2])
    ring = [
        (radius - 0.045, -0.003),
        (radius, -0.003),
        (radius, 0.003),
        (radius - 0.045, 0.003),
        (radius - 0.045, -0.003),
    ]
    hard.add("metal", "silver", disc(middle, ring, 20))


def standard_hard() -> Hard:
    """Wheels, fork, frame, engine, exhaust, lights and plate of the standard motorcycle."""
    hard = Hard(list(COLOURS))
    front, rear = (0.715, 0.0, 0.300), (-0.705, 0.0, 0.312)
    _wheel(hard, front, 0.300, 0.120, 5)
    _wheel(hard, rear, 0.312, 0.165, 5)
    for side in (0.075, -0.075):
        _brake(hard, front, side, 0.155)
    _brake(hard, rear, -0.085, 0.110)
    fork_low, fork_high = np.array([0.715, 0.105, 0.285]), np.array([0.375, 0.105, 0.985])
    knee = fork_low + 0.45 * (fork_high - fork_low)
    hard.both("metal", "bronze", tube([knee, fork_high], 0.023, 10))
    hard.both("metal", "black", tube([fork_low - [0.012, 0, -0.0], knee], 0.030, 10))
    hard.add("metal", "black", block((0.37, -0.14, 0.91), (0.43, 0.14, 0.955), pitch_deg=-26))
    hard.add("metal", "black", block((0.40, -0.14, 0.80), (0.46, 0.14, 0.84), pitch_deg=-26))
    bar = curve([(0.355, 0.0, 1.025), (0.35, 0.10, 1.04), (0.31, 0.26, 1.085), (0.245, 0.40, 1.075)], 9)
    hard.both("metal", "black", tube(bar, 0.012))
    hard.both("trim", "rubber", tube([(0.285, 0.285, 1.083), (0.238, 0.405, 1.074)], 0.019, 8))
    hard.both("metal", "grey", tube([(0.35, 0.28, 1.085), (0.32, 0.40, 1.06)], 0.007, 6))
    hard.both(
        "trim", "black", tube(curve([(0.315, 0.24, 1.085), (0.33, 0.29, 1.19), (0.30, 0.33, 1.245)], 6), 0.007, 6)
    )
    hard.both("trim", "black", block((0.275, 0.275, 1.215), (0.305, 0.405, 1.295), 0.012, pitch_deg=8))
    lamp = [(0.0, -0.09), (0.075, -0.07), (0.105, 0.0), (0.107, 0.035), (0.0, 0.04)]
    shell = disc((0.0, 0.0, 0.0), lamp, 20).transformed(rotation("z", -90.0)).translated(0.50, 0.0, 0.915)
    glass = disc((0.0, 0.0, 0.0), [(0.0, 0.036), (0.098, 0.036), (0.082, 0.052), (0.0, 0.060)], 20)
    hard.add("trim", "black", shell)
    hard.add("trim", "glass", glass.transformed(rotation("z", -90.0)).translated(0.50, 0.0, 0.915))
    hard.add("trim", "black", block((0.385, -0.09, 1.0), (0.43, 0.09, 1.09), 0.015, pitch_deg=-40))
    hard.both("trim", "amber", block((0.44, 0.155, 0.875), (0.49, 0.20, 0.91), 0.012))
    hard.both("trim", "black", tube([(0.44, 0.09, 0.89), (0.46, 0.165, 0.892)], 0.008, 6))
    spine = curve([(0.37, 0.05, 0.86), (0.15, 0.13, 0.72), (-0.12, 0.155, 0.60), (-0.20, 0.14, 0.38)], 9)
    hard.both("metal", "black", tube(spine, 0.024, 8))
    hard.both("metal", "black", tube([(0.39, 0.03, 0.80), (0.34, 0.14, 0.50), (0.26, 0.15, 0.30)], 0.018, 8))
    hard.both("metal", "black", tube([(-0.12, 0.12, 0.62), (-0.52, 0.09, 0.77), (-0.66, 0.06, 0.80)], 0.014, 6))
    hard.both(
        "metal",
        "grey",
        tube([(-0.18, 0.10, 0.40), (-0.45, 0.125, 0.36), (-0.715, 0.125, 0.312)], [0.032, 0.030, 0.022], 8),
    )
    _engine(hard)
    hard.add("trim", "black", block((0.395, -0.17, 0.46), (0.43, 0.17, 0.70), 0.008, pitch_deg=-10))
    hard.both("metal", "silver", tube([(-0.16, 0.13, 0.35), (-0.155, 0.275, 0.345)], 0.013, 8))
    hard.add("trim", "red", block((-0.755, -0.055, 0.80), (-0.715, 0.055, 0.845), 0.012))
    hard.both("trim", "amber", block((-0.72, 0.14, 0.735), (-0.67, 0.18, 0.765), 0.01))
    hard.add("trim", "black", tube([(-0.69, -0.15, 0.75), (-0.69, 0.15, 0.75)], 0.007, 6))
    hard.add("trim", "black", block((-0.80, -0.035, 0.55), (-0.70, 0.035, 0.79), 0.02, pitch_deg=22))
    hard.add_plate("MB 58 R", (-0.934, -0.10, 0.52), (-0.924, 0.10, 0.68), pitch_deg=20)
    hard.add("trim", "black", arch(rear, 0.335, 0.085, 60.0, 128.0))
    return hard


def _engine(hard: Hard) -> None:
    hard.add("metal", "grey", block((-0.16, -0.185, 0.27), (0.26, 0.185, 0.50), 0.05))
    for side in (0.19, -0.19):
        cover = disc((0.16, side, 0.385), [(0.0, -0.03), (0.085, -0.03), (0.095, 0.0), (0.085, 0.03), (0.0, 0.03)], 14)
        hard.add("metal", "silver", cover)
        rear = disc((-0.06, side, 0.395), [(0.0, -0.02), (0.075, -0.02), (0.075, 0.02), (0.0, 0.02)], 14)
        hard.add("metal", "silver", rear)
    for level in range(7):
        z = 0.50 + 0.026 * level
        x = 0.16 + 0.008 * level
        hard.add("metal", "silver", block((x - 0.12, -0.20, z), (x + 0.12, 0.20, z + 0.011), 0.003, pitch_deg=-14))
    hard.add("metal", "grey", block((0.08, -0.185, 0.49), (0.30, 0.185, 0.72), 0.03, pitch_deg=-14))
    for y in (-0.13, -0.045, 0.045, 0.13):
        pipe = curve(
            [(0.30, y, 0.60), (0.385, y, 0.52), (0.385, 0.75 * y, 0.36), (0.30, 0.4 * y, 0.225), (0.10, -0.05, 0.205)],
            9,
        )
        hard.add("metal", "bronze", tube(pipe, 0.019, 7))
    back = curve([(0.12, -0.05, 0.20), (-0.10, -0.10, 0.215), (-0.25, -0.19, 0.28), (-0.34, -0.225, 0.33)], 8)
    hard.add("metal", "silver", tube(back, 0.026, 8))
    muffler = [(-0.33, -0.225, 0.325), (-0.38, -0.228, 0.35), (-0.70, -0.235, 0.50), (-0.75, -0.236, 0.523)]
    hard.add("metal", "silver", tube(muffler, [0.035, 0.058, 0.058, 0.040], 14), crease_deg=30.0)
    hard.add("trim", "chain", block((-0.70, 0.10, 0.385), (-0.10, 0.112, 0.40)))
    hard.add("trim", "chain", block((-0.70, 0.10, 0.27), (-0.10, 0.112, 0.285)))
    spring = [
        disc((0.0, 0.0, 0.0), [(0.0, -0.008), (0.038, -0.008), (0.038, 0.008), (0.0, 0.008)], 8) for _ in range(1)
    ]
    coil = merge(
        [
            spring[0].transformed(rotation("x", 90.0)).translated(-0.30 - 0.012 * k, 0.0, 0.44 + 0.028 * k)
            for k in range(8)
        ]
    )
    hard.add("trim", "red", coil)


def standard_soft() -> list[Piece]:
    """Tank, seat, tail and mudguard of the standard motorcycle."""
    tank: Field = loft(
        ALONG_X,
        [
            (-0.06, 0.800, 0.0, 0.060, 0.095),
            (0.06, 0.845, 0.0, 0.095, 0.135),
            (0.20, 0.875, 0.0, 0.115, 0.165),
            (0.32, 0.880, 0.0, 0.100, 0.150),
            (0.385, 0.870, 0.0, 0.060, 0.090),
        ],
        cap=0.03,
        power=2.5,
    )
    knees = blend([ellipsoid(ALONG_X, (0.83, side * 0.215, 0.02), (0.12, 0.09, 0.15)) for side in (1.0, -1.0)], 0.01)
    tank = cut(tank, knees, 0.03)
    cap = ellipsoid(ALONG_X, (0.992, 0.0, 0.20), (0.012, 0.04, 0.04))
    tail: Field = loft(
        ALONG_X,
        [
            (-0.76, 0.862, 0.0, 0.022, 0.060),
            (-0.60, 0.830, 0.0, 0.050, 0.100),
            (-0.35, 0.765, 0.0, 0.055, 0.125),
            (-0.12, 0.720, 0.0, 0.055, 0.115),
        ],
        cap=0.02,
        power=2.8,
    )
    seat: Field = loft(
        ALONG_X,
        [
            (-0.70, 0.890, 0.0, 0.030, 0.080),
            (-0.52, 0.880, 0.0, 0.040, 0.120),
            (-0.38, 0.825, 0.0, 0.045, 0.140),
            (-0.18, 0.798, 0.0, 0.045, 0.130),
            (-0.03, 0.808, 0.0, 0.045, 0.085),
        ],
        cap=0.03,
        power=2.6,
    )
    guard = loft(
        ALONG_X,
        [(0.60, 0.600, 0.0, 0.010, 0.055), (0.72, 0.622, 0.0, 0.012, 0.068), (0.84, 0.585, 0.0, 0.010, 0.055)],
        cap=0.04,
        power=2.4,
    )
    side_panel = rounded_box(ALONG_X, (0.655, 0.0, -0.16), (0.09, 0.135, 0.10), 0.04)
    return [
        Piece(group="paint", field=tank, faces=620, cell_m=0.016, tint="paint"),
        Piece(group="paint", field=tail, faces=320, cell_m=0.016, tint="paint"),
        Piece(group="paint", field=guard, faces=220, cell_m=0.012, tint="paint"),
        Piece(group="trim", field=side_panel, faces=220, cell_m=0.018, tint="black"),
        Piece(group="trim", field=seat, faces=420, cell_m=0.016, tint="seat"),
        Piece(group="metal", field=cap, faces=60, cell_m=0.008, tint="silver"),
    ]


def scooter_hard() -> Hard:
    """Wheels, handlebar, lights, box and plate of the scooter."""
    hard = Hard(list(COLOURS))
    front, rear = (0.655, 0.0, 0.235), (-0.635, 0.0, 0.235)
    _wheel(hard, front, 0.235, 0.105, 5)
    _wheel(hard, rear, 0.235, 0.115, 5)
    _brake(hard, front, 0.065, 0.105)
    hard.both("metal", "black", tube([(0.655, 0.08, 0.235), (0.56, 0.08, 0.52)], 0.022, 8))
    hard.add("metal", "black", tube([(0.55, 0.0, 0.50), (0.40, 0.0, 1.0)], 0.030, 8))
    bar = curve([(0.40, 0.0, 1.04), (0.38, 0.14, 1.055), (0.33, 0.33, 1.06)], 7)
    hard.both("metal", "black", tube(bar, 0.013))
    hard.both("trim", "rubber", tube([(0.352, 0.24, 1.058), (0.325, 0.355, 1.06)], 0.019, 8))
    hard.both("metal", "grey", tube([(0.41, 0.22, 1.06), (0.385, 0.35, 1.045)], 0.006, 6))
    hard.both("trim", "black", tube(curve([(0.37, 0.20, 1.06), (0.37, 0.27, 1.18), (0.35, 0.31, 1.225)], 6), 0.007, 6))
    hard.both("trim", "black", block((0.335, 0.255, 1.20), (0.36, 0.375, 1.275), 0.012))
    hard.both("trim", "amber", block((0.535, 0.135, 0.76), (0.57, 0.185, 0.80), 0.012, pitch_deg=-18))
    hard.add("trim", "grey", block((-0.16, -0.20, 0.275), (0.40, 0.20, 0.305), 0.012))
    hard.add(
        "metal",
        "silver",
        tube([(-0.25, -0.16, 0.24), (-0.55, -0.175, 0.29), (-0.82, -0.185, 0.36)], [0.03, 0.062, 0.055], 12),
    )
    hard.add("metal", "grey", block((-0.55, 0.06, 0.20), (-0.15, 0.15, 0.34), 0.03))
    hard.add("trim", "red", block((-0.895, -0.09, 0.665), (-0.86, 0.09, 0.725), 0.014))
    hard.both("trim", "amber", block((-0.88, 0.10, 0.66), (-0.845, 0.145, 0.70), 0.012))
    hard.add("trim", "black", block((-0.90, -0.07, 0.36), (-0.84, 0.07, 0.64), 0.012, pitch_deg=14))
    hard.add_plate("HA 26 S", (-0.925, -0.10, 0.42), (-0.915, 0.10, 0.56), pitch_deg=14)
    hard.add("metal", "black", block((-0.95, -0.12, 0.845), (-0.62, 0.12, 0.865), 0.006))
    hard.add("trim", "box", block((-1.02, -0.23, 0.87), (-0.60, 0.23, 1.24), 0.035))
    hard.add("trim", "black", block((-1.03, -0.235, 1.10), (-0.595, 0.235, 1.125), 0.01))
    return hard


def scooter_soft() -> list[Piece]:
    """Leg shield, headset, body, seat and mudguards of the scooter."""
    shield = loft(
        ALONG_X.child((0.0, 0.0, 0.0)),
        [
            (0.40, 0.50, 0.0, 0.20, 0.205),
            (0.455, 0.62, 0.0, 0.32, 0.215),
            (0.51, 0.60, 0.0, 0.25, 0.17),
            (0.57, 0.58, 0.0, 0.14, 0.10),
        ],
        cap=0.02,
        power=2.6,
    )
    inner = loft(ALONG_X, [(0.10, 0.62, 0.0, 0.32, 0.17), (0.36, 0.64, 0.0, 0.30, 0.165)], cap=0.05, power=3.0)
    shield = cut(shield, inner, 0.02)
    headset = ellipsoid(ALONG_X, (1.03, 0.0, 0.425), (0.075, 0.125, 0.10))
    body = loft(
        ALONG_X,
        [
            (-0.90, 0.675, 0.0, 0.045, 0.075),
            (-0.72, 0.635, 0.0, 0.125, 0.150),
            (-0.48, 0.570, 0.0, 0.180, 0.180),
            (-0.24, 0.515, 0.0, 0.220, 0.165),
            (-0.14, 0.480, 0.0, 0.200, 0.140),
        ],
        cap=0.03,
        power=2.5,
    )
    well = ellipsoid(ALONG_X, (0.235, 0.0, -0.635), (0.262, 0.085, 0.262))
    body = cut(body, well, 0.02)
    floor = loft(ALONG_X, [(-0.18, 0.235, 0.0, 0.055, 0.17), (0.42, 0.235, 0.0, 0.055, 0.175)], cap=0.03, power=3.0)
    seat = loft(
        ALONG_X,
        [
            (-0.80, 0.815, 0.0, 0.040, 0.105),
            (-0.60, 0.800, 0.0, 0.055, 0.145),
            (-0.42, 0.770, 0.0, 0.055, 0.155),
            (-0.20, 0.755, 0.0, 0.045, 0.110),
        ],
        cap=0.04,
        power=2.6,
    )
    guard = loft(
        ALONG_X,
        [(0.50, 0.44, 0.0, 0.03, 0.075), (0.655, 0.475, 0.0, 0.025, 0.085), (0.80, 0.425, 0.0, 0.02, 0.07)],
        cap=0.05,
        power=2.4,
    )
    lamp = ellipsoid(ALONG_X, (1.03, 0.0, 0.505), (0.052, 0.085, 0.032))
    low_lamp = ellipsoid(ALONG_X, (0.66, 0.0, 0.555), (0.05, 0.075, 0.035))
    return [
        Piece(group="paint", field=shield, faces=620, cell_m=0.016, tint="paint"),
        Piece(group="paint", field=headset, faces=260, cell_m=0.014, tint="paint"),
        Piece(group="paint", field=body, faces=700, cell_m=0.016, tint="paint"),
        Piece(group="paint", field=guard, faces=260, cell_m=0.013, tint="paint"),
        Piece(group="trim", field=floor, faces=240, cell_m=0.018, tint="black"),
        Piece(group="trim", field=seat, faces=420, cell_m=0.016, tint="seat"),
        Piece(group="trim", field=lamp, faces=120, cell_m=0.010, tint="glass"),
        Piece(group="trim", field=low_lamp, faces=100, cell_m=0.010, tint="glass"),
    ]
