"""The bicycles: a trekking one and a city one with a low frame and a basket."""

from __future__ import annotations

import numpy as np

from authoring.people.field import Array
from authoring.two_wheelers.machine import COLOURS
from authoring.two_wheelers.parts import Hard, arch, block, curve, disc, rim_ring, tube, tyre, wire_spokes

RADIUS_M = 0.345
CRANK_M = 0.17
BRACKET = (-0.095, 0.0, 0.285)
_FRONT, _REAR = (0.53, 0.0, RADIUS_M), (-0.53, 0.0, RADIUS_M)


def pedal(side: float, crank_deg: float) -> tuple[float, float, float]:
    """Middle of a pedal (`side` 1 left, -1 right) with the right crank `crank_deg` below forward."""
    angle = np.radians(crank_deg + (180.0 if side > 0 else 0.0))
    x, _, z = BRACKET
    return (float(x + CRANK_M * np.cos(angle)), 0.125 * side, float(z - CRANK_M * np.sin(angle)))


def _wheels(hard: Hard, width: float) -> None:
    for centre in (_FRONT, _REAR):
        hard.add("trim", "rubber", tyre(centre, RADIUS_M, width, RADIUS_M - 0.036, 40), crease_deg=50.0)
        hard.add("metal", "silver", rim_ring(centre, RADIUS_M - 0.034, 0.024, 0.018, 40))
        hard.add("metal", "silver", wire_spokes(centre, RADIUS_M - 0.05, 0.02, 0.03, 28))
        hard.add(
            "metal",
            "grey",
            disc(
                centre,
                [(0.0, -0.06), (0.009, -0.06), (0.02, -0.034), (0.014, 0.0), (0.02, 0.034), (0.009, 0.06), (0.0, 0.06)],
                12,
            ),
        )


def _drive(hard: Hard, crank_deg: float) -> None:
    x, _, z = BRACKET
    ring = [(0.070, -0.003), (0.095, -0.003), (0.095, 0.003), (0.070, 0.003), (0.070, -0.003)]
    hard.add("metal", "grey", disc((x, -0.05, z), ring, 28))
    hard.add(
        "metal",
        "grey",
        disc((_REAR[0], -0.05, RADIUS_M), [(0.0, -0.012), (0.038, -0.012), (0.038, 0.012), (0.0, 0.012)], 18),
    )
    hard.add("metal", "grey", tube([(x, -0.065, z), (x, 0.065, z)], 0.02, 10))
    for side in (1.0, -1.0):
        px, py, pz = pedal(side, crank_deg)
        hard.add("metal", "silver", tube([(x, 0.066 * side, z), (px, 0.072 * side, pz)], [0.015, 0.010], 6))
        hard.add(
            "trim", "black", block((px - 0.05, py - 0.048, pz - 0.012), (px + 0.05, py + 0.048, pz + 0.012), 0.004)
        )
    for sprocket, ring_z in ((0.037, 0.094), (-0.037, -0.094)):
        ends = [(x, -0.05, z + ring_z), (_REAR[0], -0.05, RADIUS_M + sprocket)]
        hard.add("trim", "chain", tube(ends, 0.005, 4))


def _rear_triangle(hard: Hard, seat_joint: Array) -> None:
    for side in (1.0, -1.0):
        hard.add(
            "paint",
            "paint",
            tube([(BRACKET[0], 0.03 * side, BRACKET[2]), (_REAR[0], 0.065 * side, RADIUS_M)], 0.010, 8),
        )
        hard.add(
            "paint",
            "paint",
            tube([seat_joint + np.array([0.0, 0.02 * side, 0.0]), (_REAR[0], 0.065 * side, RADIUS_M)], 0.009, 8),
        )


def _fork(hard: Hard, low: Array, high: Array, *, group: str = "paint", tint: str = "paint") -> None:
    hard.add(group, tint, tube([low, high], 0.019, 10))
    for side in (1.0, -1.0):
        blade = curve(
            [
                low + np.array([0.0, 0.035 * side, 0.0]),
                (0.485, 0.055 * side, 0.45),
                (_FRONT[0], 0.058 * side, RADIUS_M),
            ],
            7,
        )
        hard.add(group, tint, tube(blade, [0.015, 0.015, 0.014, 0.013, 0.012, 0.010, 0.009], 8))
    hard.add(group, tint, tube([low + np.array([0.0, 0.04, 0.0]), low - np.array([0.0, 0.04, 0.0])], 0.016, 8))


def _saddle(hard: Hard, top: Array, joint: Array, tint: str) -> None:
    hard.add("metal", "silver", tube([joint, top - [0.0, 0.0, 0.03]], 0.0135, 8))
    x, _, z = top
    nose = curve([(x + 0.155, 0.0, z - 0.005), (x + 0.05, 0.0, z), (x - 0.04, 0.0, z), (x - 0.11, 0.0, z + 0.008)], 9)
    flat = (
        tube(nose, [0.018, 0.024, 0.03, 0.042, 0.056, 0.068, 0.076, 0.078, 0.060], 12)
        .translated(z=-z)
        .scaled(1.0, 1.0, 0.45)
    )
    hard.add("trim", tint, flat.translated(z=z), crease_deg=70.0)


def trekking(crank_deg: float) -> Hard:
    """A diamond frame with flat handlebar, mudguards and lights."""
    hard = Hard(list(COLOURS))
    _wheels(hard, 0.042)
    _drive(hard, crank_deg)
    joint, head_low, head_high = (
        np.array([-0.255, 0.0, 0.80]),
        np.array([0.395, 0.0, 0.685]),
        np.array([0.345, 0.0, 0.845]),
    )
    bracket = np.array(BRACKET)
    hard.add("paint", "paint", tube([bracket, joint], 0.018, 10))
    hard.add("paint", "paint", tube([bracket, head_low + np.array([-0.008, 0.0, 0.03])], 0.024, 10))
    hard.add(
        "paint",
        "paint",
        tube([joint - np.array([0.0, 0.0, 0.02]), head_high - np.array([-0.008, 0.0, 0.03])], 0.019, 10),
    )
    hard.add("paint", "paint", tube([head_low, head_high], 0.025, 10))
    _rear_triangle(hard, joint - np.array([0.0, 0.0, 0.03]))
    _fork(hard, head_low - np.array([-0.008, 0.0, 0.03]), head_low)
    stem = np.array([0.325, 0.0, 0.92])
    hard.add("metal", "black", tube([head_high, stem, stem + np.array([0.075, 0.0, 0.05])], 0.016, 8))
    bar = curve([(0.40, 0.0, 0.97), (0.395, 0.12, 0.985), (0.345, 0.30, 0.99)], 7)
    hard.both("metal", "black", tube(bar, 0.0125))
    hard.both("trim", "rubber", tube([(0.377, 0.19, 0.987), (0.343, 0.315, 0.99)], 0.017, 8))
    hard.both("metal", "grey", tube([(0.415, 0.19, 0.985), (0.385, 0.28, 0.965)], 0.006, 6))
    _saddle(hard, np.array([-0.305, 0.0, 0.965]), joint, "black")
    hard.add("trim", "black", arch(_FRONT, 0.368, 0.028, 20.0, 175.0))
    hard.add("trim", "black", arch(_REAR, 0.368, 0.028, 50.0, 185.0))
    hard.add("metal", "black", tube([head_high, (0.40, 0.0, 0.825), (0.435, 0.0, 0.822)], 0.007, 6))
    hard.add("trim", "glass", block((0.425, -0.025, 0.80), (0.475, 0.025, 0.845), 0.012))
    hard.add("trim", "red", block((-0.875, -0.022, 0.50), (-0.845, 0.022, 0.55), 0.008))
    rack = curve([(-0.30, 0.06, 0.735), (-0.50, 0.065, 0.745), (-0.78, 0.06, 0.745)], 5)
    hard.both("metal", "black", tube(rack, 0.006, 6))
    hard.both("metal", "black", tube([(-0.66, 0.06, 0.742), (_REAR[0], 0.07, RADIUS_M)], 0.005, 6))
    for x in (-0.40, -0.52, -0.64, -0.77):
        hard.add("metal", "black", tube([(x, -0.062, 0.744), (x, 0.062, 0.744)], 0.005, 6))
    return hard


def city(crank_deg: float) -> Hard:
    """A low frame with a swept handlebar, chain guard, mudguards and a basket in front."""
    hard = Hard(list(COLOURS))
    _wheels(hard, 0.044)
    _drive(hard, crank_deg)
    joint, head_low, head_high = (
        np.array([-0.245, 0.0, 0.70]),
        np.array([0.405, 0.0, 0.66]),
        np.array([0.345, 0.0, 0.875]),
    )
    bracket = np.array(BRACKET)
    hard.add("paint", "paint", tube([bracket, joint], 0.017, 10))
    low = curve([head_low + np.array([-0.005, 0.0, 0.02]), (0.22, 0.0, 0.42), (0.05, 0.0, 0.30), bracket], 10)
    hard.add("paint", "paint", tube(low, 0.024, 10))
    high = curve(
        [head_high - np.array([-0.01, 0.0, 0.06]), (0.16, 0.0, 0.52), (-0.08, 0.0, 0.43), (-0.165, 0.0, 0.48)], 10
    )
    hard.add("paint", "paint", tube(high, 0.015, 10))
    hard.add("paint", "paint", tube([head_low, head_high], 0.024, 10))
    _rear_triangle(hard, joint - np.array([0.0, 0.0, 0.04]))
    _fork(hard, head_low - np.array([-0.008, 0.0, 0.03]), head_low)
    hard.add("metal", "silver", tube([head_high, (0.30, 0.0, 1.03), (0.335, 0.0, 1.06)], 0.0135, 8))
    bar = curve([(0.345, 0.0, 1.06), (0.37, 0.14, 1.075), (0.30, 0.26, 1.08), (0.13, 0.30, 1.06)], 9)
    hard.both("metal", "silver", tube(bar, 0.0115))
    hard.both("trim", "brown", tube([(0.235, 0.285, 1.073), (0.12, 0.302, 1.058)], 0.017, 8))
    _saddle(hard, np.array([-0.305, 0.0, 0.90]), joint, "brown")
    hard.add("paint", "paint", arch(_FRONT, 0.370, 0.030, 15.0, 195.0))
    hard.add("paint", "paint", arch(_REAR, 0.370, 0.030, 40.0, 205.0))
    hard.add("trim", "black", block((-0.50, -0.075, 0.285), (0.02, -0.045, 0.40), 0.02, pitch_deg=-4))
    hard.add("metal", "silver", tube([head_low, (0.43, 0.0, 0.755), (0.465, 0.0, 0.76)], 0.007, 6))
    hard.add("trim", "glass", block((0.455, -0.028, 0.735), (0.505, 0.028, 0.785), 0.014))
    hard.add("trim", "red", block((-0.92, -0.025, 0.42), (-0.885, 0.025, 0.47), 0.008))
    _basket(hard)
    return hard


def _basket(hard: Hard) -> None:
    for z, grow in ((0.80, 0.0), (0.88, 0.015), (0.96, 0.03), (1.035, 0.045)):
        x0, x1, y = 0.43 - 0.2 * grow, 0.66 + grow, 0.145 + grow
        rim = [(x0, -y, z), (x1, -y, z), (x1, y, z), (x0, y, z), (x0, -y, z)]
        hard.add("trim", "brown", tube(rim, 0.008, 5))
    for k in range(7):
        y = -0.14 + 0.28 * k / 6
        grow = 0.045 * (1 if k in (0, 6) else 0)
        hard.add("trim", "brown", tube([(0.66, y, 0.80), (0.705, y * 1.3, 1.035)], 0.006, 4))
        hard.add("trim", "brown", tube([(0.43, y, 0.80), (0.43 - 0.2 * grow, y * 1.3, 1.035)], 0.006, 4))
        x = 0.43 + 0.23 * k / 6
        hard.both("trim", "brown", tube([(x, 0.145, 0.80), (x + 0.03, 0.19, 1.035)], 0.006, 4))
    hard.add("trim", "brown", block((0.43, -0.145, 0.795), (0.66, 0.145, 0.805), 0.002))
    hard.both("metal", "silver", tube([(0.60, 0.10, 0.80), (_FRONT[0], 0.068, RADIUS_M)], 0.005, 5))
