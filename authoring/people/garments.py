"""Clothes: each function returns the pieces of a garment for a posed skeleton; `functools.partial` sets its
parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from authoring.people.body import leg_field, torso
from authoring.people.field import attach, below, blend, cut, ellipsoid, loft, rounded_box, union
from authoring.people.piece import Piece, Tint
from authoring.people.skeleton import SIDES, Skeleton
from authoring.people.tailoring import (
    TORSO_FOLDS,
    above,
    band,
    collar_ring,
    dear_neck,
    neckline,
    sheet,
    skirt_field,
    sleeved,
    to_hem,
)

Garment = Callable[[Skeleton], list[Piece]]


def work_jacket(skeleton: Skeleton) -> list[Piece]:
    """Returns a high-visibility jacket: a loose shirt with two bright bands around it."""
    pieces = shirt(skeleton)
    pelvis, s = skeleton["pelvis"], skeleton.build.scale
    trunk = torso(skeleton, ease=(0.022, 0.022, 0.016, 0.011), folds=TORSO_FOLDS, low=-0.075)
    trunk = to_hem(skeleton, trunk, -0.055)
    for height in (0.10, 0.28):
        strip = band(trunk, pelvis, height * s, half_m=0.026, thick_m=0.009)
        pieces.append(Piece(group="extra", field=strip, faces=150, cell_m=0.010, tint="band"))
    return pieces


def t_shirt(skeleton: Skeleton, *, tint: Tint = "paint", loose: float = 0.016, sleeve: float = 0.27) -> list[Piece]:
    """Returns a T-shirt over the trousers."""
    body = torso(skeleton, ease=(loose + 0.014, loose + 0.012, loose, 0.010), folds=TORSO_FOLDS, low=-0.07)
    body = to_hem(skeleton, body, -0.035)
    body = sleeved(skeleton, body, ease=(0.012, 0.02, 0.02), sleeve=sleeve, folds=False)
    body = cut(body, neckline(skeleton, deep_m=0.0, wide_m=0.066 * (0.5 + 0.5 * skeleton.build.scale)))
    rib = collar_ring(skeleton, radius_m=0.069, height_m=0.012, open_m=0.0)
    return [
        Piece(group="paint", field=body, faces=860, cell_m=0.0125, tint=tint, dear=dear_neck(skeleton)),
        Piece(group="paint", field=rib, faces=110, cell_m=0.008, tint=tint),
    ]


def shirt(skeleton: Skeleton, *, tint: Tint = "paint", tucked: bool = False, sleeve: float = 0.97) -> list[Piece]:
    """Returns a shirt with collar and long sleeves (or rolled to `sleeve`)."""
    low = 0.055 if tucked else -0.055
    body = torso(skeleton, ease=(0.022, 0.022, 0.016, 0.011), folds=TORSO_FOLDS, low=-0.075)
    body = to_hem(skeleton, body, low)
    body = sleeved(skeleton, body, ease=(0.012, 0.013, 0.012), sleeve=sleeve, folds=True)
    body = cut(body, neckline(skeleton, deep_m=0.05, wide_m=0.06))
    collar = collar_ring(skeleton, radius_m=0.066, height_m=0.042, open_m=0.04)
    return [
        Piece(group="paint", field=body, faces=980, cell_m=0.0135, tint=tint, dear=dear_neck(skeleton)),
        Piece(group="paint", field=collar, faces=150, cell_m=0.007, tint=tint),
    ]


def hoodie(skeleton: Skeleton, *, tint: Tint = "paint") -> list[Piece]:
    """Returns a thick jumper with ribbed hems, whose hood lies on the shoulders."""
    body = torso(skeleton, ease=(0.030, 0.040, 0.026, 0.016), folds=TORSO_FOLDS, low=-0.06)
    body = cut(body, below(skeleton["pelvis"], -0.02 * skeleton.build.scale), 0.03)
    body = sleeved(skeleton, body, ease=(0.020, 0.024, 0.018), sleeve=0.98, folds=True)
    body = cut(body, neckline(skeleton, deep_m=0.0, wide_m=0.064))
    neck = skeleton["neck"]
    hood = ellipsoid(neck, (-0.075, 0.0, -0.01), (0.062, 0.115, 0.075))
    rim = cut(
        ellipsoid(neck, (-0.02, 0.0, 0.015), (0.092, 0.098, 0.04)),
        ellipsoid(neck, (0.01, 0.0, 0.04), (0.085, 0.072, 0.07)),
    )
    rim = cut(rim, rounded_box(neck, (0.12, 0.0, 0.0), (0.09, 0.03, 0.1), 0.02), 0.02)
    pouch = loft(
        skeleton["chest"], [(-0.14, 0.085, 0.0, 0.055, 0.13), (0.0, 0.085, 0.0, 0.05, 0.09)], cap=0.01, power=3.0
    )
    body = blend([body, pouch], 0.015)
    return [
        Piece(group="paint", field=body, faces=980, cell_m=0.0135, tint=tint, dear=dear_neck(skeleton)),
        Piece(group="paint", field=blend([hood, rim], 0.02), faces=240, cell_m=0.010, tint=tint),
    ]


def jacket(
    skeleton: Skeleton, *, tint: Tint = "paint", inner: Tint = "white", long_m: float = 0.0, tie: bool = False
) -> list[Piece]:
    """Returns an open jacket over a shirt; `long_m` is its length below the hips in metres, as of a coat, and `tie`
    adds a tie.
    """
    s = skeleton.build.scale
    vee = 0.20 if tie else 0.13
    body = torso(skeleton, ease=(0.034, 0.034, 0.028, 0.020), folds=TORSO_FOLDS, low=-0.085)
    if long_m > 0.0:
        body = blend([body, skirt_field(skeleton, hem_m=long_m, ease=0.035, flare=0.03)], 0.05)
    else:
        body = to_hem(skeleton, body, -0.10)
    body = sleeved(skeleton, body, ease=(0.022, 0.022, 0.022), sleeve=0.97, folds=True)
    opening = neckline(skeleton, deep_m=vee * s, wide_m=0.066)
    slit = rounded_box(skeleton["chest"], (0.2, 0.0, -0.3), (0.085, 0.0045, 0.5), 0.003)
    body = cut(cut(body, opening, 0.006), slit, 0.004)
    chest = skeleton["chest"]
    lapels = sheet(
        chest,
        torso(skeleton, ease=(0.034, 0.034, 0.028, 0.020)),
        [
            (0.385 * s - 1.12 * vee * s, 0.012, 0.004),
            (0.355 * s - 0.35 * vee * s, 0.056 * s, 0.030 * s),
            (0.385 * s, 0.068 * s, 0.016 * s),
        ],
        thick_m=0.007,
    )
    collar = collar_ring(skeleton, radius_m=0.078, height_m=0.035, open_m=0.09)
    under = torso(skeleton, ease=(0.0, 0.004, 0.008, 0.006), low=-0.02)
    under = cut(under, below(chest, 0.02 * s))
    pieces = [
        Piece(
            group="paint", field=union([body, lapels]), faces=1150, cell_m=0.0125, tint=tint, dear=dear_neck(skeleton)
        ),
        Piece(group="paint", field=collar, faces=130, cell_m=0.008, tint=tint),
        Piece(
            group="cloth",
            field=cut(under, neckline(skeleton, deep_m=0.04, wide_m=0.058)),
            faces=220,
            cell_m=0.014,
            tint=inner,
        ),
        Piece(
            group="cloth",
            field=collar_ring(skeleton, radius_m=0.064, height_m=0.042, open_m=0.02),
            faces=130,
            cell_m=0.007,
            tint=inner,
        ),
    ]
    if tie:
        rows = [
            (0.10 * s, 0.0, 0.034),
            (0.25 * s, 0.0, 0.026),
            (0.335 * s, 0.0, 0.016),
            (0.34 * s, 0.0, 0.024),
            (0.372 * s, 0.0, 0.026),
        ]
        blade = sheet(chest, under, rows, thick_m=0.008)
        pieces.append(Piece(group="extra", field=blade, faces=110, cell_m=0.008, tint="tie"))
    return pieces


def dress(
    skeleton: Skeleton, *, tint: Tint = "paint", hem_m: float = 0.46, flare: float = 0.07, sleeve: float = 0.22
) -> list[Piece]:
    """Returns a dress to the knees."""
    body = torso(skeleton, ease=(0.018, 0.010, 0.010, 0.008), folds=TORSO_FOLDS[:1])
    body = blend([body, skirt_field(skeleton, hem_m=hem_m * skeleton.build.scale, ease=0.02, flare=flare)], 0.04)
    body = sleeved(skeleton, body, ease=(0.012, 0.018, 0.016), sleeve=sleeve, folds=sleeve > 0.6)
    body = cut(body, neckline(skeleton, deep_m=0.07, wide_m=0.072))
    return [Piece(group="paint", field=body, faces=1300, cell_m=0.013, tint=tint, dear=dear_neck(skeleton))]


def skirt(skeleton: Skeleton, *, tint: Tint = "skirt", hem_m: float = 0.40, flare: float = 0.04) -> list[Piece]:
    """Returns a skirt from the waist to the knees."""
    waist = cut(torso(skeleton, ease=(0.014, 0.008, 0.0, 0.0)), below(skeleton["pelvis"], -0.06))
    waist = cut(waist, above(skeleton["pelvis"], 0.13 * skeleton.build.scale))
    field = blend([waist, skirt_field(skeleton, hem_m=hem_m * skeleton.build.scale, ease=0.016, flare=flare)], 0.03)
    return [Piece(group="cloth", field=field, faces=620, cell_m=0.0135, tint=tint)]


def trousers(
    skeleton: Skeleton, *, tint: Tint = "trousers", ease: Sequence[float] = (0.014, 0.018, 0.034), faces: int = 900
) -> list[Piece]:
    """Returns long trousers; `ease` is the distance of the cloth at hip, knee and ankle, metres."""
    s = skeleton.build.scale
    seat = torso(skeleton, ease=(0.012, 0.010, 0.0, 0.0))
    seat = cut(seat, above(skeleton["pelvis"], 0.125 * s))
    for side in SIDES:
        leg = leg_field(skeleton, side, ease=ease, folds=0.0065, past_ankle_m=0.042 * s)
        seat = attach(seat, leg, skeleton[f"thigh_{side}"].at(0.0, 0.0, -0.02), radius=0.07, reach=0.12)
    return [Piece(group="cloth", field=seat, faces=faces, cell_m=0.0135, tint=tint)]


def shorts(skeleton: Skeleton, *, tint: Tint = "trousers", leg_m: float = 0.34) -> list[Piece]:
    """Returns shorts to above the knees."""
    s = skeleton.build.scale
    seat = torso(skeleton, ease=(0.014, 0.012, 0.0, 0.0))
    seat = cut(seat, above(skeleton["pelvis"], 0.125 * s))
    for side in SIDES:
        thigh = skeleton[f"thigh_{side}"]
        leg = cut(leg_field(skeleton, side, ease=(0.016, 0.040, 0.040)), below(thigh, -leg_m * s * skeleton.build.leg))
        seat = attach(seat, leg, thigh.at(0.0, 0.0, -0.02), radius=0.07, reach=0.12)
    return [Piece(group="cloth", field=seat, faces=560, cell_m=0.0135, tint=tint)]
