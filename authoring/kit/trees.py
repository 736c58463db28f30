"""Trees: trunk, branches and a crown whose leaves are geometry; nothing is cut out of a texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.crowns import Crown, spreading, tiered
from authoring.kit.leaves import lump, on_masses, scatter_leaves
from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import ring_faces, sweep

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Species:
    """The shape of a kind of tree; lengths are shares of its height.

    Attributes:
        foliage: material of the leaves.
        crown: half the width and half the height of the crown.
        centre: height of the middle of the crown.
        boughs: number of limbs with foliage of their own; for a conifer, number of whorls.
        bough: radius of the foliage on a limb.
        leaves: number of sprays of leaves on a near tree.
        leaf_m: length of a spray on a tree of 8 m, metres.
        trunk: radius of the trunk at the ground.
        taper: degree to which the crown narrows upwards: 0 for an ellipsoid, 1 for a cone.
        upright: height of a mass of foliage divided by its width.
    """

    foliage: str
    crown: tuple[float, float]
    centre: float
    boughs: int
    bough: float
    leaves: int
    leaf_m: float
    trunk: float
    taper: float = 0.0
    upright: float = 0.92


SPECIES: dict[str, Species] = {
    "broad": Species(
        foliage="foliage_green",
        crown=(0.37, 0.33),
        centre=0.65,
        boughs=8,
        bough=0.19,
        leaves=1500,
        leaf_m=0.30,
        trunk=0.026,
    ),
    "columnar": Species(
        foliage="foliage_light",
        crown=(0.14, 0.42),
        centre=0.55,
        boughs=8,
        bough=0.112,
        leaves=1500,
        leaf_m=0.24,
        trunk=0.016,
        upright=1.5,
    ),
    "street": Species(
        foliage="foliage_olive",
        crown=(0.26, 0.28),
        centre=0.68,
        boughs=7,
        bough=0.158,
        leaves=1500,
        leaf_m=0.24,
        trunk=0.017,
    ),
    "conifer": Species(
        foliage="foliage_dark",
        crown=(0.22, 0.47),
        centre=0.54,
        boughs=8,
        bough=0.0,
        leaves=1500,
        leaf_m=0.34,
        trunk=0.017,
        taper=1.0,
    ),
    "linden": Species(
        foliage="foliage_light",
        crown=(0.26, 0.37),
        centre=0.60,
        boughs=8,
        bough=0.158,
        leaves=1500,
        leaf_m=0.26,
        trunk=0.022,
        taper=0.45,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """A part of the sprays of a crown.

    Attributes:
        share: share of the species' number of sprays.
        size: factor on the species' length of a spray.
        lift, breadth: as `scatter_leaves` takes them.
    """

    share: float
    size: float
    lift: float = 1.0
    breadth: float = 1.0


MASSES = 4
TRUNK_SIDES = 7
NEAR = (
    Layer(share=0.3, size=1.3, lift=0.2, breadth=1.5),
    Layer(share=0.75, size=0.8, lift=1.0, breadth=0.9),
)
FAR = (Layer(share=0.06, size=2.1, lift=0.6, breadth=1.3),)
"""Layers by level of detail: flat sprays that cover the masses and small ones at the outline; from afar few large ones.
"""


def tree(species: str, height_m: float, rng: np.random.Generator, *, lod: str = "near") -> list[Part]:
    """Makes one tree on the ground at the origin; all its parts have the label `vegetation`.

    Args:
        species: a key of `SPECIES`.
        height_m: height of the top of the crown in metres, at least 2.
        rng: random generator of branches and leaves.
        lod: level of detail: `near` for about 3 to 4 thousand triangles, `far` for about 300.
    """
    if species not in SPECIES:
        raise ValueError(f"no tree species named {species!r}; there are {', '.join(SPECIES)}")
    if height_m < 2:
        raise ValueError(f"a tree must be at least 2 m high, got {height_m}")
    if lod not in ("near", "far"):
        raise ValueError(f"lod must be 'near' or 'far', got {lod!r}")
    habit = SPECIES[species]
    near = lod == "near"
    sink = Sink("vegetation")
    crown = _crown(habit, height_m, rng, near=near)
    centres, radii = crown.centres, crown.radii
    _wood(sink, habit, height_m, crown.tips, near=near, rng=rng)
    middle = np.array([0.0, 0.0, habit.centre * height_m])
    masses = [
        lump(sink, habit.foliage, centre, radius, around=middle, detail=0, rng=rng)
        for centre, radius in zip(centres, radii, strict=True)
    ]
    length_m = habit.leaf_m * (height_m / 8) ** 0.5
    for layer in NEAR if near else FAR:
        count = round(habit.leaves * layer.share)
        feet, outward = on_masses(masses, centres, radii, count=count, around=middle, rng=rng)
        scatter_leaves(
            sink,
            habit.foliage,
            feet,
            outward,
            length_m=length_m * layer.size,
            lift=layer.lift,
            breadth=layer.breadth,
            rng=rng,
        )
    return sink.parts()


def _crown(habit: Species, height_m: float, rng: np.random.Generator, *, near: bool) -> Crown:
    """Draws the masses of a crown; a far tree has one mass per bough, a near tree several."""
    across, rise, middle = habit.crown[0] * height_m, habit.crown[1] * height_m, habit.centre * height_m
    if habit.taper == 1.0:
        return tiered(across, rise, middle, tiers=habit.boughs if near else 4, masses=4 if near else 2, rng=rng)
    return spreading(
        across,
        rise,
        middle,
        boughs=habit.boughs if near else 6,
        bough_m=habit.bough * height_m * (1.0 if near else 0.98),
        masses=MASSES if near else 1,
        taper=habit.taper,
        upright=habit.upright,
        rng=rng,
    )


def _wood(sink: Sink, habit: Species, height_m: float, tips: Array, *, near: bool, rng: np.random.Generator) -> None:
    """Adds trunk and limbs; the trunk of a near tree continues in the topmost bough, and limbs branch off below the
    crown.
    """
    top = tips[-1, 2] if near else habit.centre * height_m
    levels = np.array([0.0, 0.04, 0.3, 0.62, 1.0]) if near else np.array([0.0, 1.0])
    sway = rng.uniform(-1, 1, (len(levels), 2)) * habit.trunk * height_m * np.minimum(levels * 3, 1)[:, None]
    sway += tips[-1, :2] * levels[:, None] ** 2 * near
    path = np.column_stack([sway, levels * top])
    flare = np.where(levels == 0, 1.45, 1.0)
    radii = habit.trunk * height_m * (1 - 0.8 * levels) * flare
    _bark_tube(sink, path, radii, TRUNK_SIDES if near else 4)
    if not near or habit.taper == 1.0:
        return
    fork = (habit.centre - habit.crown[1]) * height_m
    for tip in tips[:-1]:
        start_z = float(np.clip(tip[2] - np.hypot(tip[0], tip[1]) * 1.1, fork * 0.86, top * 0.9))
        share = start_z / top
        start = np.array([*(np.interp(share, levels, path[:, axis]) for axis in (0, 1)), start_z])
        # Limbs leave the trunk outwards and bend up.
        middle = start * 0.45 + tip * 0.55 + (0, 0, -0.05 * height_m)
        thick = habit.trunk * height_m * (0.62 - 0.3 * share)
        _bark_tube(sink, np.stack([start, middle, tip]), np.array([thick, thick * 0.66, thick * 0.25]), 3)


def _bark_tube(sink: Sink, path: Array, radii: Array, segments: int) -> None:
    rings, normals = sweep(path, radii, segments=segments)
    # The seam needs its own column of vertices, or the bark would run backwards across the last side.
    rings = np.concatenate([rings, rings[:, :1]], 1)
    normals = np.concatenate([normals, normals[:, :1]], 1)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    around = max(1, round(2 * np.pi * float(radii.max())))
    u = np.broadcast_to(np.linspace(0, around, segments + 1), rings.shape[:2])
    v = np.broadcast_to(length[:, None], rings.shape[:2])
    faces = [f for f in ring_faces(len(path), segments + 1).tolist() if not _wraps(f, segments + 1)]
    sink.triangles(
        "bark", rings.reshape(-1, 3), faces, uvs=np.stack([u, v], -1).reshape(-1, 2), normals=normals.reshape(-1, 3)
    )


def _wraps(face: list[int], columns: int) -> bool:
    steps = [corner % columns for corner in face]
    return max(steps) - min(steps) > 1
