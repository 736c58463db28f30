"""Shapes of tree crowns: masses of foliage of different sizes on limbs, with gaps between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

GOLDEN_RAD = np.pi * (3 - np.sqrt(5))
# Of a bough's masses all but the first lie this many of its radii away from its tip.
SPREAD = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class Crown:
    """The masses of a crown and the limbs that bear them, in metres.

    Attributes:
        tips: (B, 3) ends of the limbs, the lowest first.
        centres: (K, 3) centres of the masses.
        radii: (K, 3) half extents of the masses along x, y and z.
    """

    tips: Array
    centres: Array
    radii: Array


def spreading(
    across_m: float,
    rise_m: float,
    middle_m: float,
    *,
    boughs: int,
    bough_m: float,
    masses: int,
    taper: float,
    upright: float,
    rng: np.random.Generator,
) -> Crown:
    """Draws the crown of a broadleaf tree: boughs of different sizes at different heights, each with a few masses
    around the end of its limb.

    Args:
        across_m: half the width of the crown, metres.
        rise_m: half the height of the crown, metres.
        middle_m: height of the middle of the crown, metres.
        boughs: number of boughs with the one on top.
        bough_m: radius of an average bough, metres.
        masses: number of masses of each bough.
        taper: degree to which the crown narrows upwards, 0 to 1.
        upright: height of a mass divided by its width.
        rng: random generator of the differences between trees.
    """
    side = boughs - 1
    up = np.linspace(-0.85, 0.62, side) + rng.uniform(-0.16, 0.16, side)
    turn = np.arange(side) * GOLDEN_RAD + rng.uniform(0, 2 * np.pi) + rng.uniform(-0.45, 0.45, side)
    # One or two boughs are far larger than the rest, and none is as large as any other.
    size = rng.permutation(np.linspace(0.6, 1.3, side)) * rng.uniform(0.92, 1.08, side)
    radius = np.append(bough_m * size, bough_m * rng.uniform(0.8, 1.05))
    flat = np.sqrt(np.maximum(1 - up**2, 0.16)) * (1 - taper * (up + 1) / 2 * 0.8)
    reach = np.maximum(across_m * flat * rng.uniform(0.8, 1.15, side) - radius[:-1] * 0.62, across_m * 0.14)
    height = middle_m + up * (rise_m - radius[:-1] * 0.6 * upright)
    tips = np.stack([np.cos(turn) * reach, np.sin(turn) * reach, height], 1)
    lean = rng.uniform(-0.16, 0.16, 2) * across_m
    top = np.append(lean, middle_m + rise_m - radius[-1] * (0.5 + 0.45 * upright))
    tips = np.concatenate([tips, top[None]])
    return Crown(tips, *_clusters(tips, radius, masses, np.array([1.0, 1.0, upright]), rng))


def tiered(
    across_m: float, rise_m: float, middle_m: float, *, tiers: int, masses: int, rng: np.random.Generator
) -> Crown:
    """Draws the crown of a conifer: whorls of flat boughs of different lengths, shorter upwards, with gaps between the
    whorls.
    """
    tips, radii = [], []
    foot, pitch = middle_m - rise_m, 2 * rise_m / tiers
    for tier in range(tiers):
        share = tier / tiers
        reach_m = across_m * (1 - share) ** 0.9
        count = max(2, round(masses * (1 - 0.5 * share)))
        first = float(rng.uniform(0, 2 * np.pi))
        for index in range(count):
            turn = first + (index + float(rng.uniform(-0.25, 0.25))) * 2 * np.pi / count
            radius = reach_m * float(rng.uniform(0.45, 0.62))
            reach = max(reach_m * float(rng.uniform(0.8, 1.25)) - radius, 0.02)
            z = foot + pitch * (tier + 0.45 + float(rng.uniform(-0.3, 0.3)))
            tips.append((np.cos(turn) * reach, np.sin(turn) * reach, z))
            radii.append((radius, radius, pitch * float(rng.uniform(0.62, 0.85))))
    top = middle_m + rise_m
    spire = across_m * 0.17
    tips.append((0.0, 0.0, top - spire * 1.5))
    radii.append((spire, spire, spire * 1.7))
    points = np.asarray(tips)
    return Crown(points, points, np.asarray(radii))


def _clusters(tips: Array, radius: Array, masses: int, squash: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Returns centres and half extents of the masses around each tip: one at the tip, and smaller ones around it."""
    centres, radii = [], []
    for tip, size in zip(tips, radius, strict=True):
        centres.append(tip)
        radii.append(size * (0.7 if masses > 1 else 1.0) * squash)
        first = float(rng.uniform(0, 2 * np.pi))
        for index in range(masses - 1):
            turn = first + (index + float(rng.uniform(-0.25, 0.25))) * 2 * np.pi / (masses - 1)
            lift = float(rng.uniform(-0.75, 0.75))
            away = np.array([np.cos(turn), np.sin(turn), lift]) * squash * size * SPREAD
            centres.append(tip + away)
            radii.append(size * float(rng.uniform(0.38, 0.58)) * squash)
    return np.asarray(centres), np.asarray(radii)
