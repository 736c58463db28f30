"""Shoes, and the objects that people carry."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.people.field import Array, Field, Frame, below, blend, capsule, cut, loft, rounded_box, union
from authoring.people.piece import Piece
from authoring.people.skeleton import ANKLE_M, SIDES, Skeleton

_SOLE_M = 0.026


def _along(frame: Frame) -> Frame:
    """Returns the frame whose z axis points along the foot and whose x axis points upwards."""
    return Frame(frame.origin, frame.figure_from_local @ np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]))


def shoes(skeleton: Skeleton, *, high: float = 0.0, sole_m: float = _SOLE_M) -> list[Piece]:
    """Returns a pair of shoes; `high` is the height of the shaft above the ankle in metres, as of boots."""
    return [_shoe(skeleton, side, high, sole_m) for side in SIDES]


def _shoe(skeleton: Skeleton, side: str, high: float, sole_m: float) -> Piece:
    s = skeleton.build.scale * (0.95 if skeleton.build.female else 1.0)
    foot, toes = skeleton[f"foot_{side}"], skeleton[f"toes_{side}"]
    ground = -ANKLE_M * skeleton.build.scale
    inwards = -1.0 if side == "left" else 1.0

    def row(x: float, z: float, half_height: float, half_width: float, shift: float = 0.0) -> tuple[float, ...]:
        return (x * s, ground + (z + half_height) * s, -shift * inwards * s, half_height * s, half_width * s)

    hind = loft(
        _along(foot),
        [
            row(-0.068, -0.01, 0.040, 0.031),
            row(-0.030, -0.01, 0.050, 0.035),
            row(0.030, -0.01, 0.050, 0.038),
            row(0.085, -0.01, 0.038, 0.045),
            row(0.135, -0.01, 0.032, 0.050, 0.004),
        ],
        cap=0.016,
        power=2.6,
    )
    hind = cut(hind, below(foot, ground), 0.003)

    def toe_row(x: float, half_height: float, half_width: float, shift: float) -> tuple[float, ...]:
        return (x * s, (-0.01 + half_height) * s, -shift * inwards * s, half_height * s, half_width * s)

    front = loft(
        _along(toes),
        [
            toe_row(-0.020, 0.034, 0.049, 0.003),
            toe_row(0.030, 0.030, 0.049, 0.005),
            toe_row(0.066, 0.025, 0.041, 0.008),
        ],
        cap=0.022,
        power=2.5,
    )
    front = cut(front, below(toes, 0.0), 0.003)
    shaft = loft(
        skeleton[f"shin_{side}"],
        [
            (z, 0.0, 0.0, 0.042 * s, 0.038 * s)
            for z in (
                -0.432 * skeleton.build.scale * skeleton.build.leg,
                -0.432 * skeleton.build.scale * skeleton.build.leg + 0.02 + high,
            )
        ],
        cap=0.005,
    )

    def over_sole(points: Array) -> Array:
        ahead = toes.to_local(points)
        return np.where(ahead[:, 0] > 0.0, ahead[:, 2], foot.to_local(points)[:, 2] - ground) - sole_m * s

    def tint(points: Array) -> list[str]:
        return ["sole" if height < 0.0 else "shoe" for height in over_sole(points)]

    field: Field = blend([hind, front, shaft], 0.02)
    return Piece(group="shoes", field=field, faces=270, cell_m=0.0095, tint=tint, borders=(over_sole,))


def backpack(skeleton: Skeleton) -> list[Piece]:
    """Returns a rucksack with its straps."""
    chest, s = skeleton["chest"], skeleton.build.scale
    bag = rounded_box(chest, (-0.225 * s, 0.0, 0.15 * s), (0.092, 0.145, 0.215), 0.055)
    pocket = rounded_box(chest, (-0.315 * s, 0.0, 0.07 * s), (0.04, 0.115, 0.095), 0.03)
    straps: list[Field] = []
    for side in (1.0, -1.0):
        y = side * 0.098 * s
        path = [
            (-0.14, y * 0.85, 0.335),
            (-0.05, y, 0.378),
            (0.045, y * 1.05, 0.348),
            (0.118, y * 1.12, 0.25),
            (0.105, y * 1.35, 0.12),
            (0.0, y * 1.78, 0.04),
            (-0.13, y * 1.4, 0.0),
        ]
        scaled = [(x * s, yy, z * s) for x, yy, z in path]
        straps += [capsule(chest, a, b, 0.026) for a, b in itertools.pairwise(scaled)]
    strap = Piece(group="extra", field=blend(straps, 0.01), faces=260, cell_m=0.012, tint="bag_dark")
    return [Piece(group="extra", field=blend([bag, pocket], 0.015), faces=260, cell_m=0.014, tint="bag"), strap]


def shoulder_bag(skeleton: Skeleton) -> list[Piece]:
    """Returns a handbag at the left hip with a strap over the shoulder."""
    chest, s = skeleton["chest"], skeleton.build.scale
    bag = rounded_box(chest, (-0.02, 0.235 * s, -0.12 * s), (0.135, 0.045, 0.105), 0.028)
    top = (-0.012 * s, 0.128 * s, 0.368 * s)
    strap = union(
        [
            capsule(chest, top, (0.11 * s, 0.185 * s, 0.15 * s), 0.011),
            capsule(chest, (0.11 * s, 0.185 * s, 0.15 * s), (0.09, 0.225 * s, -0.04 * s), 0.011),
            capsule(chest, top, (-0.125 * s, 0.185 * s, 0.18 * s), 0.011),
            capsule(chest, (-0.125 * s, 0.185 * s, 0.18 * s), (-0.12, 0.225 * s, -0.04 * s), 0.011),
        ]
    )
    return [Piece(group="extra", field=union([bag, strap]), faces=360, cell_m=0.009, tint="bag")]


def phone(skeleton: Skeleton) -> list[Piece]:
    """Returns a telephone in the right hand."""
    hand = skeleton["hand_right"]
    body = rounded_box(hand, (0.0, 0.022, -0.095), (0.037, 0.006, 0.076), 0.004)
    return [Piece(group="extra", field=body, faces=44, cell_m=0.006, tint="black")]


def briefcase(skeleton: Skeleton) -> list[Piece]:
    """Returns a briefcase in the right hand."""
    hand = skeleton["hand_right"]
    frame = Frame(hand.at(0.0, 0.0, -0.11), np.eye(3))
    case = rounded_box(frame, (0.0, 0.0, -0.19), (0.205, 0.045, 0.145), 0.012)
    grip = union(
        [
            capsule(frame, (-0.06, 0.0, -0.045), (-0.05, 0.0, 0.0), 0.009),
            capsule(frame, (0.06, 0.0, -0.045), (0.05, 0.0, 0.0), 0.009),
            capsule(frame, (-0.05, 0.0, 0.0), (0.05, 0.0, 0.0), 0.011),
        ]
    )
    return [Piece(group="extra", field=union([case, grip]), faces=220, cell_m=0.010, tint="bag")]
