"""Parts of garments as distance fields: sleeves, necklines, collars, hems, sheets and skirts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from authoring.people.body import arm_field, leg_field
from authoring.people.field import Array, Field, Fold, Frame, attach, below, blend, cut, loft, rounded_box, union
from authoring.people.skeleton import SIDES, Skeleton

TORSO_FOLDS = (
    Fold(0.02, 0.10, 0.004, 0.07, 0.6),
    Fold(0.26, 0.10, 0.0025, 0.09, 2.2),
)
"""Wrinkles of cloth at the waist and on the chest."""


def sleeved(skeleton: Skeleton, body: Field, *, ease: Sequence[float], sleeve: float, folds: bool) -> Field:
    """Returns `body` with sleeves; `sleeve` is their length as a share of the arm: 0.5 ends at the elbow, 1 at the
    wrist, and 0 is no sleeve.
    """
    for side in SIDES:
        arm = arm_field(skeleton, side, ease=ease, folds=folds)
        upper, fore = skeleton[f"upper_arm_{side}"], skeleton[f"forearm_{side}"]
        elbow = -fore.to_local(upper.origin[None])[0]
        length = float(np.linalg.norm(elbow))
        if sleeve <= 0.55:
            arm = cut(arm, below(upper, -2.0 * sleeve * length))
            arm = cut(arm, below(fore, -0.35 * length)) if sleeve < 0.5 else arm
        else:
            arm = cut(arm, below(fore, -(2.0 * sleeve - 1.0) * 0.86 * length))
        body = attach(body, arm, upper.at(0.0, 0.0, -0.02), radius=0.05, reach=0.10)
    return body


def neckline(skeleton: Skeleton, *, deep_m: float, wide_m: float) -> Field:
    """Returns the opening for the neck, which reaches `deep_m` metres below the root of the neck in front."""
    s = skeleton.build.scale
    neck = skeleton["neck"]
    hole = loft(
        neck,
        [(-0.06 * s, 0.01, 0.0, wide_m * 0.9, wide_m * 0.9), (0.12 * s, 0.0, 0.0, wide_m * 1.1, wide_m * 1.15)],
        cap=0.02,
    )
    if deep_m <= 0.0:
        return hole
    chest = skeleton["chest"]
    vee = loft(
        chest,
        [(0.35 * s - deep_m, 0.13, 0.0, 0.08, 0.006), (0.38 * s, 0.10, 0.0, 0.10, wide_m * 0.95)],
        cap=0.004,
    )
    return union([hole, vee])


def collar_ring(skeleton: Skeleton, *, radius_m: float, height_m: float, open_m: float) -> Field:
    """Returns a standing collar with a gap of `open_m` metres in front."""
    s = skeleton.build.scale
    neck = skeleton["neck"]
    k = 0.5 + 0.5 * s
    ring = [
        (-0.02 * s, -0.002, 0.0, radius_m * 1.12 * k, radius_m * 1.2 * k),
        (height_m, 0.004, 0.0, radius_m * k, radius_m * k),
    ]
    inner = [(z, x, y, d - 0.011, w - 0.011) for z, x, y, d, w in ring]
    collar = cut(loft(neck, ring, cap=0.004), loft(neck, inner, cap=0.02), 0.003)
    if open_m:
        collar = cut(collar, rounded_box(neck, (0.1, 0.0, 0.03), (0.08, open_m / 2, 0.08), 0.01), 0.006)
    return collar


def band(base: Field, frame: Frame, z: float, *, half_m: float, thick_m: float) -> Field:
    """Returns a strip of cloth around `base` at a height of the frame."""

    def distance(points: Array) -> Array:
        skin = base(points)
        level = np.abs(frame.to_local(points)[:, 2] - z) - half_m
        return np.asarray(np.maximum.reduce([skin - thick_m, -skin - thick_m, level]))

    return distance


def sheet(frame: Frame, base: Field, rows: Sequence[tuple[float, float, float]], *, thick_m: float) -> Field:
    """Returns cloth that lies on the front of `base`: rows of (z, distance from the middle, half-width), on
    both sides.
    """
    table = np.array(sorted(rows))

    def distance(points: Array) -> Array:
        x, y, z = frame.to_local(points).T
        middle, half = (np.interp(z, table[:, 0], table[:, k]) for k in (1, 2))
        edge = np.maximum(np.abs(np.abs(y) - middle) - half, np.maximum(table[0, 0] - z, z - table[-1, 0]))
        skin = base(points)
        return np.asarray(np.maximum.reduce([skin - thick_m, -skin - thick_m, edge, 0.02 - x]))

    return distance


def dear_neck(skeleton: Skeleton) -> Callable[[Array], Array]:
    """Returns the function `Piece.dear` that gives necklines, collars and lapels more triangles."""
    chest = skeleton["chest"]
    high = 0.25 * skeleton.build.scale

    def dear(points: Array) -> Array:
        local = chest.to_local(points)
        near = (local[:, 2] > high) & (np.abs(local[:, 1]) < 0.1)
        return np.where(near, 6.0, 1.0)

    return dear


def to_hem(skeleton: Skeleton, body: Field, low: float) -> Field:
    """Returns `body`, widened around the hips of the trousers, and cut off at `low` (metres above the hip joints, for
    an adult).
    """
    legs = [leg_field(skeleton, side, ease=(0.036, 0.04, 0.04)) for side in SIDES]
    return cut(blend([body, *legs], 0.05), below(skeleton["pelvis"], low * skeleton.build.scale))


def skirt_field(skeleton: Skeleton, *, hem_m: float, ease: float, flare: float, top_m: float = 0.1) -> Field:
    """Returns cloth around both legs from `top_m` over the hip joints to `hem_m` below them, wide enough for the
    stride.
    """
    s = skeleton.build.scale
    chains = [np.stack([skeleton[f"{bone}_{side}"].origin for bone in ("thigh", "shin", "foot")]) for side in SIDES]
    hips = skeleton["pelvis"].origin[2]
    heights = np.array([hips - hem_m, hips - 0.25 * hem_m, hips, hips + top_m])
    radii = np.array([0.062, 0.084, 0.088, 0.088]) * s + ease + np.array([flare, 0.25 * flare, 0.0, -0.02])

    def distance(points: Array) -> Array:
        z = np.clip(points[:, 2], heights[0], heights[-1])
        ends = []
        for chain in chains:
            down = chain[::-1]
            ends.append(np.stack([np.interp(z, down[:, 2], down[:, k]) for k in (0, 1)], axis=1))
        a, b = ends
        axis = b - a
        flat = points[:, :2]
        share = np.clip(((flat - a) * axis).sum(axis=1) / np.maximum((axis**2).sum(axis=1), 1e-9), 0.0, 1.0)
        offset = flat - a - share[:, None] * axis
        angle = np.arctan2(flat[:, 1] - 0.5 * (a + b)[:, 1], flat[:, 0] - 0.5 * (a + b)[:, 0])
        depth = np.interp(z, heights, [0.010, 0.006, 0.001, 0.0]) * min(1.0, 0.3 + 12.0 * flare) * s
        pleats = depth * np.sin(7.0 * angle + 1.2 * np.sin(2.0 * angle + 1.0))
        wall = np.linalg.norm(offset, axis=1) - np.interp(z, heights, radii) - pleats
        return np.asarray(np.maximum(wall, np.maximum(heights[0] - points[:, 2], points[:, 2] - heights[-1])))

    return distance


def above(frame: Frame, z: float) -> Field:
    """Returns the half-space above the plane z of a frame."""
    return lambda points: -below(frame, z)(points)
