"""Caps and hats, with the hair under them."""

from __future__ import annotations

from functools import partial

import numpy as np

from authoring.people.field import Array, Frame, blend, cut, ellipsoid, loft, rounded_box, union
from authoring.people.hair import short_hair
from authoring.people.piece import Piece
from authoring.people.skeleton import Skeleton


def baseball_cap(skeleton: Skeleton) -> list[Piece]:
    """Returns a cap with a peak, and short hair below it."""
    head, k = skeleton["head"], skeleton.build.head
    dome = ellipsoid(head, (-0.012 * k, 0.0, 0.045 * k), (0.112 * k, 0.091 * k, 0.092 * k))
    low = Frame(head.origin, head.figure_from_local)
    dome = cut(dome, rounded_box(low, (0.0, 0.0, -0.065 * k), (0.3, 0.3, 0.11 * k), 0.004), 0.006)
    peak = ellipsoid(head, (0.10 * k, 0.0, 0.045 * k), (0.085 * k, 0.072 * k, 0.011))
    button = ellipsoid(head, (-0.012 * k, 0.0, 0.138 * k), (0.010, 0.010, 0.006))
    cap = Piece(group="extra", field=blend([dome, peak, button], 0.008), faces=340, cell_m=0.0085, tint="hat")
    return [*short_hair(skeleton), cap]


def brimmed_hat(skeleton: Skeleton) -> list[Piece]:
    """Returns a felt hat with a brim all around and a ribbon."""
    head, k = skeleton["head"], skeleton.build.head
    crown = loft(
        head,
        [
            (0.045 * k, -0.01, 0.0, 0.108 * k, 0.088 * k),
            (0.10 * k, -0.01, 0.0, 0.100 * k, 0.080 * k),
            (0.150 * k, -0.012, 0.0, 0.082 * k, 0.062 * k),
        ],
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
    """Returns a knitted cap with a turned-up edge."""
    head, k = skeleton["head"], skeleton.build.head
    dome = ellipsoid(head, (-0.016 * k, 0.0, 0.045 * k), (0.112 * k, 0.091 * k, 0.098 * k))
    dome = cut(dome, rounded_box(head, (0.0, 0.0, -0.09 * k), (0.3, 0.3, 0.125 * k), 0.004), 0.006)
    edge = loft(
        head,
        [(0.036 * k, -0.012, 0.0, 0.114 * k, 0.094 * k), (0.066 * k, -0.012, 0.0, 0.113 * k, 0.093 * k)],
        cap=0.004,
    )
    knit = Piece(group="extra", field=union([dome, edge]), faces=320, cell_m=0.009, tint="hat")
    return [*short_hair(skeleton), knit]
