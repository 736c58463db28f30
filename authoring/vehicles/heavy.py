"""Specifications of the bus and of the cab of the lorries."""

from __future__ import annotations

from authoring.vehicles.car import CarSpec, Points, Stamp
from authoring.vehicles.outlines import body_plan
from authoring.vehicles.shell import Level
from authoring.vehicles.wheels import WheelSpec

__all__ = ["BUS", "CAB"]

BUS = CarSpec(
    name="bus_city",
    kind="bus",
    palette="bus",
    plan=body_plan(6.0, -6.0, 1.275, 0.9, 0.5),
    foot=((6.0, 0.32), (-6.0, 0.34)),
    rim=((6.0, 1.12), (-6.0, 1.12)),
    crown=((6.0, 1.12), (-6.0, 1.12)),
    levels=(
        Level(0.0, 0.10, 0.10, 0.10),
        Level(0.02, 0.02, 0.03, 0.02),
        Level(0.2, 0.0, 0.0, 0.0),
        Level(0.6, 0.0, 0.0, 0.0),
        Level(0.9, 0.003, 0.008, 0.003),
        Level(1.0, 0.006, 0.012, 0.006),
    ),
    cabin_plan=body_plan(5.99, -5.995, 1.27, 0.9, 0.5),
    cabin_foot=((6.0, 1.11), (-6.0, 1.11)),
    cabin_rim=((6.0, 2.94), (-6.0, 2.96)),
    cabin_crown=((6.0, 2.98), (-6.0, 3.06)),
    cabin_levels=(
        Level(0.0, 0.0, 0.0, 0.0),
        Level(0.30, 0.008, 0.03, 0.01),
        Level(0.62, 0.02, 0.08, 0.02),
        Level(0.86, 0.035, 0.13, 0.03),
        Level(0.97, 0.055, 0.17, 0.045),
        Level(1.0, 0.15, 0.30, 0.14),
    ),
    cabin_reach=(0.9, 0.9),
    rise=1.88,
    axles=(3.25, -2.75),
    wheel=WheelSpec(0.48, 0.30, 0.29, 0, dish=0.09),
    track=2.18,
    arch=0.07,
    flare=0.0,
    sill_z=0.43,
    pillar=0.06,
    screen_v=(0.0, 0.84),
    side_v=(0.05, 0.74),
    side_glass=(0.09, 0.20),
    rear_glass=(0.14, 0.16, 0.66),
    glass_posts=tuple((x, 0.045) for x in (4.3, 2.9, 1.5, 0.1, -1.3, -2.7, -4.1)),
    stamps=(
        Stamp("front", ((-0.8, 0.42), (0.72, 0.42), (0.72, 0.60), (-0.8, 0.60)), 0.03, "trim", "slats", 0.01),
        Stamp(
            "front", ((0.80, 0.62), (1.22, 0.62), (1.32, 0.70), (1.28, 0.84), (0.80, 0.84)),
            0.04, "lights", "head_block", 0.0,
        ),
        Stamp("rear", ((1.00, 0.58), (1.19, 0.58), (1.19, 1.10), (1.00, 1.10)), 0.03, "lights", "tail_tall", 0.0, 0.02),
        Stamp("rear", ((-0.9, 0.62), (0.86, 0.62), (0.86, 1.05), (-0.9, 1.05)), 0.03, "trim", "slats", 0.004),
        Stamp("rear", ((-0.9, 0.36), (1.10, 0.36), (1.10, 0.50), (-0.9, 0.50)), 0.03, "trim", "plastic", -0.01),
    ),
    plates=(0.51, 0.56),
    plate_stand_off=0.02,
    lines_side=(
        *(((x, 0.36), (x, 1.10)) for x in (4.6, 2.3, 1.1, -0.1, -1.3, -3.7, -4.8)),
        ((5.8, 1.07), (-5.9, 1.07)),
        ((5.6, 2.62), (-5.9, 2.62)),
    ),
    lines_rear=(
        ((0.0, 1.22), (0.92, 1.22), (0.92, 0.56), (0.0, 0.56)),
        ((1.20, 0.54), (0.0, 0.54)),
        ((0.0, 1.34), (1.22, 1.34)),
    ),
    mirror=None,
    badges=(0.90, None),
    paint_px=(512, 512),
)  # fmt: skip


def _cab_plan(front: float, rear: float, half: float) -> Points:
    return (
        (front, 0.0), (front, 0.45 * half), (front - 0.05, 0.76 * half), (front - 0.17, 0.965 * half),
        (front - 0.42, half), ((front + rear) / 2, half), (rear + 0.25, half), (rear + 0.04, half),
        (rear, 0.95 * half), (rear, 0.5 * half), (rear, 0.0),
    )  # fmt: skip


CAB = CarSpec(
    name="cab",
    kind="truck",
    palette="truck",
    plan=_cab_plan(0.95, -0.95, 1.12),
    foot=((0.95, 0.42), (-0.95, 0.52)),
    rim=((0.95, 1.42), (-0.95, 1.42)),
    crown=((0.95, 1.42), (-0.95, 1.42)),
    levels=(
        Level(0.0, 0.10, 0.10, 0.02),
        Level(0.02, 0.03, 0.03, 0.0),
        Level(0.2, 0.0, 0.0, 0.0),
        Level(0.5, 0.0, 0.0, 0.0),
        Level(0.85, 0.005, 0.03, 0.0),
        Level(1.0, 0.012, 0.05, 0.0),
    ),
    cabin_plan=_cab_plan(0.91, -0.945, 1.11),
    cabin_foot=((0.95, 1.40), (-0.95, 1.40)),
    cabin_rim=((0.95, 2.42), (0.2, 2.55), (-0.95, 2.60)),
    cabin_crown=((0.95, 2.45), (0.2, 2.66), (-0.95, 2.70)),
    cabin_levels=(
        Level(0.0, 0.0, 0.0, 0.0),
        Level(0.30, 0.02, 0.10, 0.0),
        Level(0.62, 0.06, 0.23, 0.0),
        Level(0.86, 0.10, 0.36, 0.0),
        Level(0.97, 0.135, 0.46, 0.01),
        Level(1.0, 0.22, 0.62, 0.08),
    ),
    cabin_reach=(0.9, 0.3),
    reach=(0.5, 0.3),
    rise=1.18,
    axles=(-0.20,),
    wheel=WheelSpec(0.42, 0.25, 0.25, 0, dish=-0.05),
    track=1.92,
    arch=0.08,
    flare=0.0,
    sill_z=0.56,
    door_rear=-0.60,
    screen_v=(0.03, 0.66),
    side_v=(0.05, 0.64),
    side_glass=(0.10, 0.10),
    rear_glass=(9.0, 0.1, 0.2),
    blind_sides=(-1.0, -0.55),
    handles=((-0.42, 1.22),),
    stamps=(
        Stamp("front", ((-0.8, 0.98), (0.74, 0.98), (0.78, 1.26), (-0.8, 1.26)), 0.03, "trim", "slats", 0.02),
        Stamp("front", ((0.70, 0.60), (1.06, 0.60), (1.08, 0.76), (0.70, 0.76)), 0.03, "lights", "head_block", 0.0),
        Stamp(
            "front", ((-0.8, 0.46), (1.10, 0.46), (1.20, 0.62), (1.20, 0.84), (-0.8, 0.84)),
            0.03, "trim", "plastic", -0.015,
        ),
        Stamp("front", ((0.96, 1.02), (1.10, 1.02), (1.10, 1.12), (0.96, 1.12)), 0.02, "lights", "amber", -0.004),
    ),
    plates=(0.56, 0.56),
    lines_side=(
        ((0.27, 0.62), (0.56, 0.62), (0.56, 0.9), (0.54, 1.40), (0.57, 1.5)),
        ((-0.60, 0.75), (-0.60, 2.40)),
    ),
    lines_front=(((0.0, 0.90), (0.92, 0.90), (0.95, 1.36), (0.0, 1.36)),),
    mirror=(0.10, 0.20, 0.40),
)  # fmt: skip
