"""Hair styles, in the head's frame."""

from __future__ import annotations

import numpy as np

from authoring.people.field import Array, Field, Frame, blend, cut, ellipsoid, loft, union
from authoring.people.piece import Piece
from authoring.people.skeleton import Skeleton


def _strands(field: Field, frame: Frame, depth: float, wavelength: float = 0.022) -> Field:
    """Adds the relief of hair to a field: grooves that run downwards from the crown."""

    def distance(points: Array) -> Array:
        local = frame.to_local(points)
        angle = np.arctan2(local[:, 1], local[:, 0] + 0.02)
        wave = np.sin(0.09 / wavelength * 2.0 * np.pi * angle + 9.0 * np.sin(local[:, 2] * 21.0))
        return field(points) - depth * wave * np.clip(0.8 - local[:, 0] * 10.0, 0.0, 1.0)

    return distance


def _cap_field(skeleton: Skeleton, thick: float, *, nape: float, ears: float, fringe: float) -> Field:
    """Returns the field of hair close to the skull, which ends at `nape` at the back, at `ears` at the sides and at
    `fringe` above the forehead (z in the frame of the head, metres).
    """
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

    return _strands(cut(shell, removed, 0.01), head, 0.0016)


def _hair(field: Field, faces: int, cell_m: float = 0.01) -> Piece:
    return Piece(group="hair", field=field, faces=faces, cell_m=cell_m, tint="hair")


def short_hair(skeleton: Skeleton) -> list[Piece]:
    """Returns short hair that leaves the ears free."""
    return [_hair(_cap_field(skeleton, 0.013, nape=-0.075, ears=0.012, fringe=0.066), 420)]


def crop(skeleton: Skeleton) -> list[Piece]:
    """Returns hair of one centimetre."""
    return [_hair(_cap_field(skeleton, 0.006, nape=-0.06, ears=0.016, fringe=0.068), 340)]


def thinning(skeleton: Skeleton) -> list[Piece]:
    """Returns the hair of an old man: bald on top, with a wreath of hair around."""
    field = _cap_field(skeleton, 0.009, nape=-0.07, ears=0.006, fringe=0.075)
    top = ellipsoid(skeleton["head"], (0.025, 0.0, 0.115), (0.105, 0.062, 0.075))
    return [_hair(cut(field, top, 0.012), 320)]


def bob(skeleton: Skeleton) -> list[Piece]:
    """Returns hair down to the chin, with a fringe."""
    return [
        _hair(
            union(
                [_cap_field(skeleton, 0.018, nape=-0.08, ears=-0.03, fringe=0.042), _curtain(skeleton, -0.105, 0.024)]
            ),
            520,
        )
    ]


def long_hair(skeleton: Skeleton) -> list[Piece]:
    """Returns hair that reaches below the shoulders."""
    return [
        _hair(
            union(
                [_cap_field(skeleton, 0.015, nape=-0.08, ears=-0.01, fringe=0.06), _curtain(skeleton, -0.235, 0.026)]
            ),
            700,
        )
    ]


def ponytail(skeleton: Skeleton) -> list[Piece]:
    """Returns hair that is pulled back into a ponytail."""
    head = skeleton["head"]
    tail = loft(
        head,
        [
            (0.065, -0.118, 0.0, 0.018, 0.018),
            (0.03, -0.145, 0.0, 0.024, 0.026),
            (-0.06, -0.142, 0.0, 0.026, 0.03),
            (-0.17, -0.118, 0.0, 0.010, 0.014),
        ],
        cap=0.014,
    )
    return [
        _hair(
            union([_cap_field(skeleton, 0.010, nape=-0.065, ears=0.012, fringe=0.066), _strands(tail, head, 0.003)]),
            520,
        )
    ]


def bun(skeleton: Skeleton) -> list[Piece]:
    """Returns hair that is tied into a knot at the back."""
    knot = ellipsoid(skeleton["head"], (-0.118, 0.0, 0.045), (0.034, 0.040, 0.036))
    return [
        _hair(
            union(
                [
                    _cap_field(skeleton, 0.011, nape=-0.065, ears=0.006, fringe=0.062),
                    _strands(knot, skeleton["head"], 0.003),
                ]
            ),
            480,
        )
    ]


def curls(skeleton: Skeleton) -> list[Piece]:
    """Returns curly hair, round the whole head."""
    head = skeleton["head"]
    base = _cap_field(skeleton, 0.042, nape=-0.075, ears=-0.012, fringe=0.058)

    def distance(points: Array) -> Array:
        local = head.to_local(points) * 150.0
        return base(points) - 0.004 * np.sin(local[:, 0]) * np.sin(local[:, 1] + 1.0) * np.sin(local[:, 2])

    return [_hair(distance, 640, 0.011)]


def _curtain(skeleton: Skeleton, low: float, thick: float) -> Field:
    """Returns the field of hair that hangs behind the face, from the crown down to `low` (z in the head's frame)."""
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
        [
            (0.07, 0.11, 0.0, 0.055, 0.045),
            (0.0, 0.10, 0.0, 0.085, 0.062),
            (-0.10, 0.10, 0.0, 0.105, 0.066),
            (low - 0.05, 0.10, 0.0, 0.12, 0.10),
        ],
        cap=0.02,
        power=3.0,
    )
    return _strands(cut(hang, face, 0.012), head, 0.0016)
