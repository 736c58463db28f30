"""Control polygons and levels that the cars share: plans of bodies and cabins, their cross-sections, a fuel flap."""

from __future__ import annotations

from authoring.vehicles.car import Points
from authoring.vehicles.shell import Level

__all__ = ["body_levels", "body_plan", "cabin_levels", "cabin_plan", "flap"]


def body_plan(front: float, rear: float, half: float, nose: float = 1.0, tail: float = 1.0) -> Points:
    """Returns the widest outline of a car as a control polygon; `nose` and `tail` scale how rounded its ends are."""
    return (
        (front, 0.0), (front, 0.42 * half), (front - 0.05 * nose, 0.72 * half), (front - 0.17 * nose, 0.95 * half),
        (front - 0.46 * nose, half), (front - 0.95, half), (0.55, half), (-0.35, half), (rear + 0.95, half),
        (rear + 0.40 * tail, half), (rear + 0.14 * tail, 0.95 * half), (rear + 0.03 * tail, 0.72 * half),
        (rear, 0.42 * half), (rear, 0.0),
    )  # fmt: skip


def cabin_plan(front: float, rear: float, half: float, bow: float = 0.22, tail: float = 0.16) -> Points:
    """Returns the outline of the foot of a cabin; `bow` and `tail` are the bulges of windscreen and rear window,
    metres.
    """
    span = front - rear
    return (
        (front, 0.0), (front, 0.35 * half), (front - 0.35 * bow, 0.74 * half), (front - 0.95 * bow, 0.97 * half),
        (front - bow - 0.10 * span, 1.0 * half), (front - 0.36 * span, half), (front - 0.58 * span, half),
        (rear + tail + 0.14 * span, 0.985 * half), (rear + 0.95 * tail, 0.93 * half), (rear + 0.3 * tail, 0.70 * half),
        (rear, 0.34 * half), (rear, 0.0),
    )  # fmt: skip


def flap(x: float, z: float, half: float = 0.075) -> Points:
    """Returns the shut line of a fuel flap around (x, z)."""
    low, high, left, right = z - half, z + half, x - half, x + half
    return ((left, low), (right, low), (right, high), (left, high), (left, low))


def body_levels(nose: float = 0.24, tail: float = 0.09, shoulder: float = 0.095) -> tuple[Level, ...]:
    """Returns the cross-section of a body: sill, side with a crease, shoulder; the arguments are how far it narrows
    towards the top in each direction, metres.
    """
    return (
        Level(0.0, 0.10, 0.12, 0.12),
        Level(0.02, 0.035, 0.03, 0.03),
        Level(0.16, 0.012, 0.0, 0.0),
        Level(0.40, 0.0, -0.005, -0.005),
        Level(0.62, 0.008, 0.06 * nose, 0.0),
        Level(0.73, 0.0, 0.17 * nose, 0.1 * tail),
        Level(0.78, 0.1 * shoulder, 0.25 * nose, 0.2 * tail),
        Level(0.93, 0.42 * shoulder, 0.54 * nose, 0.45 * tail),
        Level(1.0, shoulder, nose, tail),
    )


def cabin_levels(front: float, rear: float, side: float = 0.27) -> tuple[Level, ...]:
    """Returns the cross-section of a cabin; the arguments are the distances of its roof from its foot in each
    direction, metres.
    """
    return (
        Level(0.0, 0.0, 0.0, 0.0),
        Level(0.30, 0.11 * side, 0.29 * front, 0.29 * rear),
        Level(0.62, 0.37 * side, 0.59 * front, 0.58 * rear),
        Level(0.88, 0.61 * side, 0.80 * front, 0.79 * rear),
        Level(0.98, 0.78 * side, 0.90 * front, 0.89 * rear),
        Level(1.0, side, front, rear),
    )
