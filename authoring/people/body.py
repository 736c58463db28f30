"""The body: stations (cross-sections) of every limb, and its bare parts. Garments are the same limbs, enlarged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from authoring.people.field import (
    Field,
    Fold,
    Frame,
    attach,
    below,
    blend,
    capsule,
    cut,
    ellipsoid,
    loft,
    rounded_box,
)
from authoring.people.piece import Piece
from authoring.people.skeleton import SIDES, Build, Skeleton

Station = tuple[float, float, float, float, float]

PELVIS: list[Station] = [
    (-0.085, -0.010, 0.0, 0.072, 0.105),
    (-0.020, -0.014, 0.0, 0.108, 0.162),
    (0.050, -0.008, 0.0, 0.108, 0.164),
    (0.110, 0.000, 0.0, 0.098, 0.152),
    (0.170, 0.003, 0.0, 0.094, 0.142),
]
CHEST: list[Station] = [
    (-0.040, 0.003, 0.0, 0.095, 0.141),
    (0.030, 0.004, 0.0, 0.097, 0.140),
    (0.100, 0.004, 0.0, 0.104, 0.147),
    (0.180, 0.004, 0.0, 0.113, 0.158),
    (0.250, 0.000, 0.0, 0.111, 0.162),
    (0.310, -0.008, 0.0, 0.094, 0.146),
    (0.350, -0.014, 0.0, 0.072, 0.106),
    (0.390, -0.016, 0.0, 0.058, 0.066),
]
UPPER_ARM: list[Station] = [
    (0.030, 0.0, 0.0, 0.036, 0.034),
    (-0.005, 0.0, 0.0, 0.049, 0.047),
    (-0.055, 0.0, 0.0, 0.054, 0.050),
    (-0.140, 0.003, 0.0, 0.049, 0.044),
    (-0.240, 0.000, 0.0, 0.041, 0.038),
    (-0.300, 0.000, 0.0, 0.038, 0.037),
]
FOREARM: list[Station] = [
    (0.000, 0.0, 0.0, 0.038, 0.037),
    (-0.060, 0.0, 0.0, 0.043, 0.040),
    (-0.150, 0.0, 0.0, 0.035, 0.032),
    (-0.252, 0.0, 0.0, 0.028, 0.022),
]
THIGH: list[Station] = [
    (0.020, 0.0, 0.0, 0.088, 0.080),
    (-0.100, 0.004, 0.0, 0.086, 0.079),
    (-0.200, 0.004, 0.0, 0.076, 0.071),
    (-0.330, 0.002, 0.0, 0.062, 0.060),
    (-0.428, 0.000, 0.0, 0.056, 0.054),
]
SHIN: list[Station] = [
    (0.000, 0.000, 0.0, 0.056, 0.054),
    (-0.060, -0.002, 0.0, 0.053, 0.052),
    (-0.130, -0.012, 0.0, 0.058, 0.053),
    (-0.220, -0.013, 0.0, 0.050, 0.046),
    (-0.330, -0.006, 0.0, 0.037, 0.035),
    (-0.430, 0.000, 0.0, 0.034, 0.031),
]


def sized(
    stations: Sequence[Station], build: Build, *, girth: float = 1.0, ease: float = 0.0, length: float = 1.0
) -> list[Station]:
    """Returns the stations of a build: scaled by its height, in girth also by a factor, and enlarged by `ease`
    metres.
    """
    s = build.scale
    wide = s * girth
    return [(z * s * length, x * wide, y * wide, d * wide + ease, w * wide + ease) for z, x, y, d, w in stations]


def torso(skeleton: Skeleton, *, ease: Sequence[float], folds: Sequence[Fold] = (), low: float = -0.085) -> Field:
    """Returns the field of pelvis and chest, with cloth `ease` metres around (hips, waist, chest, shoulders); `low` is
    its lowest station.
    """
    build = skeleton.build
    hips, waist, chest, shoulders = ease
    lower = [row for row in PELVIS if row[0] >= low]
    if low < PELVIS[0][0]:
        lower = [(low, *lower[1][1:]), *lower[1:]]
    pelvis = _widened(lower, build, [(-0.02, build.hips, hips), (0.14, build.waist, waist)])
    upper = _widened(
        CHEST,
        build,
        [
            (0.0, build.waist, waist),
            (0.16, build.chest, chest),
            (0.26, build.chest, chest),
            (0.34, build.shoulders, shoulders),
        ],
    )
    fields = [
        loft(skeleton["pelvis"], pelvis, cap=0.02, power=2.3, folds=folds),
        loft(skeleton["chest"], upper, cap=(0.04, 0.01), power=2.3, folds=folds),
    ]
    s = build.scale
    if build.bust_m:
        for side in (1.0, -1.0):
            centre = (0.075 * s, side * 0.068 * s, 0.19 * s)
            fields.append(
                ellipsoid(skeleton["chest"], centre, (build.bust_m + chest + 0.035, 0.062 + chest, 0.065 + chest))
            )
    if build.belly_m:
        radii = (0.09 + build.belly_m + waist, 0.13 * build.waist + waist, 0.14)
        fields.append(ellipsoid(skeleton["chest"], (0.03, 0.0, 0.0), radii))
    return blend(fields, 0.07)


def _widened(stations: Sequence[Station], build: Build, marks: Sequence[tuple[float, float, float]]) -> list[Station]:
    heights = [mark[0] for mark in marks]
    s, result = build.scale, []
    for z, x, y, depth, width in stations:
        factor = float(np.interp(z, heights, [mark[1] for mark in marks]))
        ease = float(np.interp(z, heights, [mark[2] for mark in marks]))
        wide = s * factor
        result.append((z * s, x * s, y * s, depth * s * (0.4 + 0.6 * factor) + ease, width * wide + ease))
    return result


def arm_field(skeleton: Skeleton, side: str, *, ease: Sequence[float] = (0.0, 0.0, 0.0), folds: bool = False) -> Field:
    """Returns the field of upper arm and forearm, enlarged by `ease` metres at shoulder, elbow and wrist; `folds` are
    the wrinkles at the elbow.
    """
    build = skeleton.build
    shoulder, elbow, wrist = ease
    upper = sized(UPPER_ARM, build, girth=build.limbs)
    upper = [
        (*row[:3], row[3] + e, row[4] + e)
        for row, e in zip(upper, np.linspace(shoulder, elbow, len(upper)), strict=True)
    ]
    fore = sized(FOREARM, build, girth=build.limbs)
    fore = [
        (*row[:3], row[3] + e, row[4] + e) for row, e in zip(fore, np.linspace(elbow, wrist, len(fore)), strict=True)
    ]
    bunch = (Fold(-0.27, 0.08, 0.005, 0.05, 0.4),) if folds else ()
    sleeve = (Fold(-0.02, 0.07, 0.005, 0.045, 1.4), Fold(-0.22, 0.06, 0.004, 0.04, 2.4)) if folds else ()
    return blend(
        [
            loft(skeleton[f"upper_arm_{side}"], upper, cap=0.02, folds=bunch),
            loft(skeleton[f"forearm_{side}"], fore, cap=0.012, folds=sleeve),
        ],
        0.03,
    )


def leg_field(
    skeleton: Skeleton,
    side: str,
    *,
    ease: Sequence[float] = (0.0, 0.0, 0.0),
    folds: float = 0.0,
    past_ankle_m: float = 0.0,
) -> Field:
    """Returns the field of thigh and shin, enlarged by `ease` metres at hip, knee and ankle, with wrinkles of `folds`
    metres; cloth may reach `past_ankle_m` below the ankle.
    """
    build = skeleton.build
    hip, knee, ankle = ease
    girth = build.limbs
    length = build.leg
    thigh = sized(THIGH, build, girth=girth * (0.5 + 0.5 * build.hips), length=length)
    thigh = [
        (*row[:3], row[3] + e, row[4] + e) for row, e in zip(thigh, np.linspace(hip, knee, len(thigh)), strict=True)
    ]
    shin = sized(SHIN, build, girth=girth, length=length)
    shin = [
        (*row[:3], row[3] + e, row[4] + e) for row, e in zip(shin, np.linspace(knee, ankle, len(shin)), strict=True)
    ]
    if past_ankle_m:
        last = shin[-1]
        shin.append((last[0] - past_ankle_m, *last[1:]))
    knees = (Fold(-0.36, 0.10, 0.6 * folds, 0.085, 0.3), Fold(-0.02, 0.09, 0.8 * folds, 0.07, 2.0)) if folds else ()
    ankles = (Fold(-0.39, 0.09, 1.1 * folds, 0.055, 1.1), Fold(-0.10, 0.09, 0.5 * folds, 0.08, 0.8)) if folds else ()
    return blend(
        [
            loft(skeleton[f"thigh_{side}"], thigh, cap=0.05, folds=knees),
            loft(skeleton[f"shin_{side}"], shin, cap=0.01, folds=ankles),
        ],
        0.035,
    )


def hand_field(skeleton: Skeleton, side: str) -> Field:
    """Returns the field of a relaxed hand: palm, four curled fingers and a thumb."""
    build = skeleton.build
    k = build.scale * (0.86 if build.female else 0.95)
    inwards = -1.0 if side == "left" else 1.0
    frame = Frame(skeleton[f"hand_{side}"].origin, skeleton[f"hand_{side}"].figure_from_local * k)
    unit = Frame(frame.origin, skeleton[f"hand_{side}"].figure_from_local)
    palm = rounded_box(unit, (0.002 * k, 0.0, -0.052 * k), (0.041 * k, 0.0145 * k, 0.05 * k), 0.013 * k)
    wrist = capsule(frame, (0.0, 0.0, 0.02), (0.0, 0.0, -0.02), 0.023 * k)
    fingers = []
    for number, x in enumerate((-0.029, -0.010, 0.010, 0.029)):
        reach = (0.060, 0.074, 0.078, 0.070)[number]
        knuckle, joint = (x, 0.0, -0.094), (x, 0.010 * inwards, -0.096 - 0.5 * reach)
        tip = (x, 0.036 * inwards, -0.096 - 0.88 * reach)
        fingers.append(
            blend(
                [capsule(frame, knuckle, joint, 0.0096 * k), capsule(frame, joint, tip, 0.009 * k, 0.0075 * k)], 0.004
            )
        )
    base, knob, end = (
        (0.028, 0.004 * inwards, -0.02),
        (0.052, 0.014 * inwards, -0.058),
        (0.052, 0.024 * inwards, -0.092),
    )
    thumb = blend(
        [capsule(frame, base, knob, 0.016 * k, 0.0115 * k), capsule(frame, knob, end, 0.0115 * k, 0.009 * k)], 0.008
    )
    return blend([palm, wrist, thumb, *fingers], 0.007)


def bare_arms(skeleton: Skeleton, *, arms: bool) -> list[Piece]:
    """Returns the pieces of the hands, and of the arms if no sleeve covers them."""
    pieces = []
    for side in SIDES:
        hand = hand_field(skeleton, side)
        if arms:
            limb = arm_field(skeleton, side)
            shoulder = skeleton[f"upper_arm_{side}"].child(
                (0.0, 0.0, -0.07 * skeleton.build.scale), np.diag([1.0, -1.0, -1.0])
            )
            limb = cut(limb, below(shoulder, 0.0))
            field = attach(limb, hand, skeleton[f"hand_{side}"].origin, radius=0.03, reach=0.05)
            pieces.append(Piece(group="skin", field=field, faces=420, cell_m=0.0085, tint="skin"))
        else:
            pieces.append(Piece(group="skin", field=hand, faces=230, cell_m=0.0065, tint="skin"))
    return pieces


def bare_legs(skeleton: Skeleton, *, tint: str = "skin", group: str = "skin") -> list[Piece]:
    """Returns the pieces of bare legs."""
    return [Piece(group=group, field=leg_field(skeleton, side), faces=260, cell_m=0.013, tint=tint) for side in SIDES]
