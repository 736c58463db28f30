"""Heads: face, neck, hair and what is worn on top. Head frame: origin between the ears at eye height."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from authoring.people.field import (
    Array,
    Field,
    Frame,
    attach,
    blend,
    capsule,
    cut,
    ellipsoid,
    loft,
    rounded_box,
    union,
)
from authoring.people.piece import Piece
from authoring.people.skeleton import Skeleton

Hair = Callable[[Skeleton], list[Piece]]


def face_field(skeleton: Skeleton) -> Field:
    """Skull, face and neck."""
    build, head = skeleton.build, skeleton["head"]
    k = build.head
    frame = Frame(head.origin, head.figure_from_local * k)
    unit = Frame(head.origin, head.figure_from_local)
    soft = build.female
    jaw = 0.90 if soft else 1.0
    skull = ellipsoid(unit, (-0.012 * k, 0.0, 0.030 * k), (0.099 * k, 0.077 * k, 0.084 * k))
    visage = loft(
        unit,
        [
            (z * k, x * k, 0.0, d * k, w * k)
            for z, x, d, w in (
                (-0.112, 0.058, 0.028 * jaw, 0.026 * jaw),
                (-0.092, 0.043, 0.047, 0.043 * jaw),
                (-0.062, 0.030, 0.061, 0.056 * jaw),
                (-0.022, 0.020, 0.071, 0.066),
                (0.025, 0.010, 0.083, 0.072),
            )
        ],
        cap=(0.008, 0.03),
        power=2.2,
    )
    brow = 0.007 if soft else 0.009
    features = [
        capsule(frame, (0.083, 0.034, 0.017), (0.086, 0.012, 0.017), brow * k),
        capsule(frame, (0.083, -0.034, 0.017), (0.086, -0.012, 0.017), brow * k),
        ellipsoid(unit, (0.058 * k, 0.040 * k, -0.030 * k), (0.032 * k, 0.026 * k, 0.026 * k)),
        ellipsoid(unit, (0.058 * k, -0.040 * k, -0.030 * k), (0.032 * k, 0.026 * k, 0.026 * k)),
        ellipsoid(unit, (0.074 * k, 0.0, -0.100 * k), (0.019 * k, 0.020 * k, 0.015 * k)),
    ]
    solid = blend([skull, visage, *features], 0.022)
    for side in (1.0, -1.0):
        solid = cut(solid, ellipsoid(unit, (0.099 * k, side * 0.033 * k, 0.001 * k), (0.013 * k, 0.017 * k, 0.0125 * k)), 0.014)
    eyes = [ellipsoid(unit, (0.0775 * k, side * 0.032 * k, 0.0), (0.0125 * k,) * 3) for side in (1.0, -1.0)]
    tip = 0.106 if soft else 0.109
    nose = blend(
        [
            capsule(frame, (0.090, 0.0, 0.006), (tip, 0.0, -0.036), 0.0065 * k, 0.0105 * k),
            capsule(frame, (0.096, 0.011, -0.041), (0.096, -0.011, -0.041), 0.0085 * k),
        ],
        0.012,
    )
    lips = blend(
        [
            capsule(frame, (0.0865, 0.017, -0.0655), (0.0865, -0.017, -0.0655), 0.0062 * k),
            capsule(frame, (0.0855, 0.014, -0.0755), (0.0855, -0.014, -0.0755), 0.0070 * k),
        ],
        0.004,
    )
    ears = [
        rounded_box(_ear(unit, side, k), (0.0, 0.0, 0.0), (0.017 * k, 0.006 * k, 0.031 * k), 0.006 * k) for side in (1.0, -1.0)
    ]
    solid = blend([solid, nose], 0.012)
    solid = blend([solid, lips], 0.006)
    return blend([solid, *eyes, *ears], 0.004)


def _ear(unit: Frame, side: float, k: float) -> Frame:
    c, s = np.cos(0.35), np.sin(0.35) * side
    return unit.child((-0.006 * k, side * 0.078 * k, -0.006 * k), np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def neck_field(skeleton: Skeleton) -> Field:
    """Neck and the part of the upper chest that a neckline shows."""
    build = skeleton.build
    s = build.scale
    girth = (0.88 if build.female else 1.0) * min(1.08, 0.5 + 0.5 * build.limbs) * (0.5 + 0.5 * s)
    neck = loft(
        skeleton["neck"],
        [
            (-0.035 * s, 0.0, 0.0, 0.058 * girth, 0.074 * girth),
            (0.010 * s, 0.0, 0.0, 0.056 * girth, 0.061 * girth),
            (0.060 * s, 0.002, 0.0, 0.055 * girth, 0.056 * girth),
            (0.115 * s, 0.004, 0.0, 0.056 * girth, 0.055 * girth),
        ],
        cap=0.02,
    )
    yoke = ellipsoid(skeleton["chest"], (-0.012 * s, 0.0, 0.300 * s), (0.082 * s, 0.115 * s * build.shoulders, 0.075 * s))
    return blend([neck, yoke], 0.04)


def head_piece(skeleton: Skeleton) -> Piece:
    """Head and neck; the face is dear to the thinning."""
    head = skeleton["head"]
    field = attach(face_field(skeleton), neck_field(skeleton), skeleton["neck"].at(0.0, 0.0, 0.09), radius=0.03, reach=0.12)

    def dear(points: Array) -> Array:
        local = head.to_local(points)
        front = (local[:, 0] > 0.045) & (np.abs(local[:, 1]) < 0.06) & (np.abs(local[:, 2] + 0.03) < 0.09)
        return np.where(front, 14.0, np.where(local[:, 2] > -0.12, 2.0, 0.6))

    return Piece(group="skin", field=field, faces=1050, cell_m=0.007, tint="face", dear=dear)


def _strands(field: Field, frame: Frame, depth: float, wavelength: float = 0.022) -> Field:
    """Hair's texture: grooves that run from the crown down."""

    def distance(points: Array) -> Array:
        local = frame.to_local(points)
        angle = np.arctan2(local[:, 1], local[:, 0] + 0.02)
        wave = np.sin(0.09 / wavelength * 2.0 * np.pi * angle + 9.0 * np.sin(local[:, 2] * 21.0))
        return field(points) - depth * wave * np.clip(0.8 - local[:, 0] * 10.0, 0.0, 1.0)

    return distance


def _cap_field(skeleton: Skeleton, thick: float, *, nape: float, ears: float, fringe: float) -> Field:
    """Hair close to the skull: down to `nape` behind, to `ears` at the sides and `fringe` over the forehead (z, m)."""
    head, k = skeleton["head"], skeleton.build.head
    shell = ellipsoid(
        head,
        (-0.014 * k, 0.0, 0.032 * k),
        (0.099 * k + thick, 0.077 * k + thick, 0.085 * k + 1.15 * thick),
    )
    back = ellipsoid(head, (-0.045 * k, 0.0, -0.01 * k), (0.062 * k + thick, 0.066 * k + thick, 0.10 * k))
    shell = blend([shell, back], 0.03)

    azimuths = np.radians([0.0, 38.0, 56.0, 70.0, 88.0, 112.0, 128.0, 150.0, 180.0])
    levels = [fringe, fringe, 0.8 * fringe + 0.2 * ears, ears - 0.008, ears, ears, min(ears, -0.01), nape, nape]

    def removed(points: Array) -> Array:
        local = head.to_local(points) / k
        azimuth = np.abs(np.arctan2(local[:, 1], local[:, 0] + 0.01))
        return (local[:, 2] - np.interp(azimuth, azimuths, levels)) * 0.7 * k

    return _strands(cut(shell, removed, 0.01), head, 0.0022)


def _hair(field: Field, faces: int, cell_m: float = 0.01) -> Piece:
    return Piece(group="hair", field=field, faces=faces, cell_m=cell_m, tint="hair")


def short_hair(skeleton: Skeleton) -> list[Piece]:
    """Short all around, ears free."""
    return [_hair(_cap_field(skeleton, 0.013, nape=-0.075, ears=0.012, fringe=0.066), 420)]


def crop(skeleton: Skeleton) -> list[Piece]:
    """Clipped to a centimetre."""
    return [_hair(_cap_field(skeleton, 0.006, nape=-0.06, ears=0.016, fringe=0.068), 340)]


def thinning(skeleton: Skeleton) -> list[Piece]:
    """An old man's: bald on top, a wreath around."""
    field = _cap_field(skeleton, 0.009, nape=-0.07, ears=0.006, fringe=0.075)
    top = ellipsoid(skeleton["head"], (0.025, 0.0, 0.115), (0.105, 0.062, 0.075))
    return [_hair(cut(field, top, 0.012), 320)]


def bob(skeleton: Skeleton) -> list[Piece]:
    """Chin-long, with a fringe."""
    return [_hair(union([_cap_field(skeleton, 0.018, nape=-0.08, ears=-0.03, fringe=0.042), _curtain(skeleton, -0.105, 0.024)]), 520)]


def long_hair(skeleton: Skeleton) -> list[Piece]:
    """Past the shoulders."""
    return [_hair(union([_cap_field(skeleton, 0.015, nape=-0.08, ears=-0.01, fringe=0.06), _curtain(skeleton, -0.235, 0.026)]), 620)]


def ponytail(skeleton: Skeleton) -> list[Piece]:
    """Pulled back and tied."""
    head = skeleton["head"]
    tail = loft(
        head,
        [(0.065, -0.118, 0.0, 0.018, 0.018), (0.03, -0.145, 0.0, 0.024, 0.026), (-0.06, -0.142, 0.0, 0.026, 0.03), (-0.17, -0.118, 0.0, 0.010, 0.014)],
        cap=0.014,
    )
    return [_hair(union([_cap_field(skeleton, 0.010, nape=-0.065, ears=0.012, fringe=0.066), _strands(tail, head, 0.003)]), 520)]


def bun(skeleton: Skeleton) -> list[Piece]:
    """Tied into a knot at the back."""
    knot = ellipsoid(skeleton["head"], (-0.118, 0.0, 0.045), (0.034, 0.040, 0.036))
    return [_hair(union([_cap_field(skeleton, 0.011, nape=-0.065, ears=0.006, fringe=0.062), _strands(knot, skeleton["head"], 0.003)]), 480)]


def curls(skeleton: Skeleton) -> list[Piece]:
    """A round head of curls."""
    head = skeleton["head"]
    base = _cap_field(skeleton, 0.042, nape=-0.075, ears=-0.012, fringe=0.058)

    def distance(points: Array) -> Array:
        local = head.to_local(points) * 150.0
        return base(points) - 0.004 * np.sin(local[:, 0]) * np.sin(local[:, 1] + 1.0) * np.sin(local[:, 2])

    return [_hair(distance, 640, 0.011)]


def _curtain(skeleton: Skeleton, low: float, thick: float) -> Field:
    """Hair that hangs behind the face, from the crown down to `low` (z in the head's frame)."""
    head, k = skeleton["head"], skeleton.build.head
    hang = loft(
        head,
        [
            (0.07 * k, -0.02, 0.0, 0.075 + thick, 0.068 + thick),
            (0.0, -0.025, 0.0, 0.078 + thick, 0.070 + thick),
            (min(-0.07, low / 2), -0.038, 0.0, 0.066 + thick, 0.072 + thick),
            (low, -0.052, 0.0, 0.050 + thick, 0.064 + thick),
        ],
        cap=0.02,
        power=2.4,
    )
    face = loft(
        head,
        [(0.07, 0.11, 0.0, 0.055, 0.045), (0.0, 0.10, 0.0, 0.085, 0.062), (-0.10, 0.10, 0.0, 0.105, 0.066), (low - 0.05, 0.10, 0.0, 0.12, 0.10)],
        cap=0.02,
        power=3.0,
    )
    return _strands(cut(hang, face, 0.012), head, 0.003)


def baseball_cap(skeleton: Skeleton) -> list[Piece]:
    """A cap with a peak, over short hair."""
    head, k = skeleton["head"], skeleton.build.head
    dome = ellipsoid(head, (-0.012 * k, 0.0, 0.045 * k), (0.112 * k, 0.091 * k, 0.092 * k))
    low = Frame(head.origin, head.figure_from_local)
    dome = cut(dome, rounded_box(low, (0.0, 0.0, -0.065 * k), (0.3, 0.3, 0.11 * k), 0.004), 0.006)
    peak = ellipsoid(head, (0.10 * k, 0.0, 0.045 * k), (0.085 * k, 0.072 * k, 0.011))
    button = ellipsoid(head, (-0.012 * k, 0.0, 0.138 * k), (0.010, 0.010, 0.006))
    cap = Piece(group="extra", field=blend([dome, peak, button], 0.008), faces=340, cell_m=0.0085, tint="hat")
    return [*short_hair(skeleton), cap]


def brimmed_hat(skeleton: Skeleton) -> list[Piece]:
    """A felt hat with a brim all around and a ribbon."""
    head, k = skeleton["head"], skeleton.build.head
    crown = loft(
        head,
        [(0.045 * k, -0.01, 0.0, 0.108 * k, 0.088 * k), (0.10 * k, -0.01, 0.0, 0.100 * k, 0.080 * k), (0.150 * k, -0.012, 0.0, 0.082 * k, 0.062 * k)],
        cap=(0.004, 0.014),
        power=2.4,
    )
    brim = ellipsoid(head, (-0.004, 0.0, 0.048 * k), (0.165 * k, 0.145 * k, 0.009))

    def ribbon(points: Array) -> list[str]:
        z = head.to_local(points)[:, 2] / k
        x, y, _ = head.to_local(points).T
        on = (z > 0.058) & (z < 0.085) & (np.hypot(x, y) < 0.13)
        return ["hat_band" if flag else "hat" for flag in on]

    edges = tuple(partial(_over, head, level * k) for level in (0.058, 0.085))
    hat = Piece(group="extra", field=blend([crown, brim], 0.012), faces=420, cell_m=0.008, tint=ribbon, borders=edges)
    return [*short_hair(skeleton), hat]


def _over(frame: Frame, z: float, points: Array) -> Array:
    return np.asarray(frame.to_local(points)[:, 2] - z)


def beanie(skeleton: Skeleton) -> list[Piece]:
    """A knitted cap with a turned-up edge."""
    head, k = skeleton["head"], skeleton.build.head
    dome = ellipsoid(head, (-0.016 * k, 0.0, 0.045 * k), (0.112 * k, 0.091 * k, 0.098 * k))
    dome = cut(dome, rounded_box(head, (0.0, 0.0, -0.09 * k), (0.3, 0.3, 0.125 * k), 0.004), 0.006)
    edge = loft(head, [(0.036 * k, -0.012, 0.0, 0.114 * k, 0.094 * k), (0.066 * k, -0.012, 0.0, 0.113 * k, 0.093 * k)], cap=0.004)
    knit = Piece(group="extra", field=union([dome, edge]), faces=320, cell_m=0.009, tint="hat")
    return [*short_hair(skeleton), knit]
