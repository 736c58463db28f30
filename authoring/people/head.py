"""Heads: face and neck. Head frame: origin between the ears at eye height."""

from __future__ import annotations

import numpy as np

from authoring.people.field import Array, Field, Frame, attach, blend, capsule, cut, ellipsoid, loft, rounded_box
from authoring.people.piece import Piece
from authoring.people.skeleton import Skeleton

EYE = (0.0775, 0.032, 0.0)
"""The middle of the left eyeball in the head's frame, metres, for a head of factor 1."""

EAR = (-0.006, 0.078, -0.006)
"""The middle of the left ear, in the same frame."""


def nose_tip(*, soft: bool) -> tuple[float, float, float]:
    """Returns the centre of the ball at the tip of the nose, (3,) metres, in the frame of the head.

    Args:
        soft: whether the face has softer features, such as those of a woman.
    """
    return (0.106 if soft else 0.109, 0.0, -0.036)


def face_field(skeleton: Skeleton) -> Field:
    """Returns the field of skull, face and neck."""
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
        solid = cut(
            solid, ellipsoid(unit, (0.099 * k, side * 0.033 * k, 0.001 * k), (0.013 * k, 0.017 * k, 0.0125 * k)), 0.014
        )
    eyes = [ellipsoid(unit, (EYE[0] * k, side * EYE[1] * k, EYE[2]), (0.0125 * k,) * 3) for side in (1.0, -1.0)]
    nose = blend(
        [
            capsule(frame, (0.090, 0.0, 0.006), nose_tip(soft=soft), 0.0065 * k, 0.0105 * k),
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
        rounded_box(_ear(unit, side, k), (0.0, 0.0, 0.0), (0.017 * k, 0.006 * k, 0.031 * k), 0.006 * k)
        for side in (1.0, -1.0)
    ]
    solid = blend([solid, nose], 0.012)
    solid = blend([solid, lips], 0.006)
    return blend([solid, *eyes, *ears], 0.004)


def _ear(unit: Frame, side: float, k: float) -> Frame:
    c, s = np.cos(0.35), np.sin(0.35) * side
    return unit.child(
        (EAR[0] * k, side * EAR[1] * k, EAR[2] * k), np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    )


def neck_field(skeleton: Skeleton) -> Field:
    """Returns the field of the neck and the part of the upper chest that a neckline shows."""
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
    yoke = ellipsoid(
        skeleton["chest"], (-0.012 * s, 0.0, 0.300 * s), (0.082 * s, 0.115 * s * build.shoulders, 0.075 * s)
    )
    return blend([neck, yoke], 0.04)


def head_piece(skeleton: Skeleton) -> Piece:
    """Returns the piece of head and neck; the face keeps more triangles than the rest."""
    head = skeleton["head"]
    field = attach(
        face_field(skeleton), neck_field(skeleton), skeleton["neck"].at(0.0, 0.0, 0.09), radius=0.03, reach=0.12
    )

    def dear(points: Array) -> Array:
        local = head.to_local(points)
        front = (local[:, 0] > 0.045) & (np.abs(local[:, 1]) < 0.06) & (np.abs(local[:, 2] + 0.03) < 0.09)
        return np.where(front, 14.0, np.where(local[:, 2] > -0.12, 2.0, 0.6))

    return Piece(group="skin", field=field, faces=1050, cell_m=0.007, tint="face", dear=dear)
