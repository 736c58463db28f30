"""Trees: trunk, branches and a crown whose leaves are geometry; nothing is cut out of a texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.leaves import lump, on_masses, scatter_leaves
from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import ring_faces, sweep

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Species:
    """A tree's habit, lengths as shares of its height.

    Attributes:
        foliage: material of the leaves.
        crown: half extents of the crown (across, up).
        centre: height of the crown's middle.
        lumps: masses of foliage that make the crown.
        lump: radius of one.
        leaves: sprays of leaves on a near tree.
        leaf_m: length of a spray on a tree of 8 m.
        trunk: radius at the foot.
        taper: how much the crown narrows upwards: 0 ellipsoid, 1 cone.
    """

    foliage: str
    crown: tuple[float, float]
    centre: float
    lumps: int
    lump: float
    leaves: int
    leaf_m: float
    trunk: float
    taper: float = 0.0


SPECIES: dict[str, Species] = {
    "broad": Species(
        foliage="foliage_green",
        crown=(0.37, 0.33),
        centre=0.65,
        lumps=30,
        lump=0.125,
        leaves=1500,
        leaf_m=0.30,
        trunk=0.026,
    ),
    "columnar": Species(
        foliage="foliage_light",
        crown=(0.14, 0.42),
        centre=0.55,
        lumps=26,
        lump=0.082,
        leaves=1500,
        leaf_m=0.24,
        trunk=0.016,
    ),
    "street": Species(
        foliage="foliage_olive",
        crown=(0.26, 0.28),
        centre=0.68,
        lumps=24,
        lump=0.105,
        leaves=1500,
        leaf_m=0.24,
        trunk=0.017,
    ),
    "conifer": Species(
        foliage="foliage_dark",
        crown=(0.22, 0.47),
        centre=0.54,
        lumps=30,
        lump=0.085,
        leaves=1500,
        leaf_m=0.34,
        trunk=0.017,
        taper=1.0,
    ),
    "linden": Species(
        foliage="foliage_light",
        crown=(0.26, 0.37),
        centre=0.60,
        lumps=28,
        lump=0.105,
        leaves=1500,
        leaf_m=0.26,
        trunk=0.022,
        taper=0.45,
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """A part of a crown's sprays.

    Attributes:
        share: of the habit's number of leaves.
        size: of the habit's spray.
        lift, breadth: as `scatter_leaves` takes them.
    """

    share: float
    size: float
    lift: float = 1.0
    breadth: float = 1.0


NEAR = (
    Layer(share=0.3, size=1.3, lift=0.2, breadth=1.5),
    Layer(share=0.75, size=0.8, lift=1.0, breadth=0.9),
)
FAR = (Layer(share=0.06, size=2.6, lift=0.35, breadth=1.4),)
"""Shingles that cover the masses, and small sprays that make the outline; from afar a few large ones do."""


def tree(species: str, height_m: float, rng: np.random.Generator, *, lod: str = "near") -> list[Part]:
    """One tree on the ground at the origin, all of it labelled vegetation.

    Args:
        species: of `SPECIES`.
        height_m: to the top of the crown, at least 2.
        rng: decides branches and leaves.
        lod: `near` for about 3 to 4 thousand triangles, `far` for about 400.
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
    centres, radii = _crown(habit, height_m, rng, lumps=habit.lumps if near else 9)
    if not near:
        radii = radii * 1.5
    _wood(sink, habit, height_m, centres, near=near, rng=rng)
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


def _crown(habit: Species, height_m: float, rng: np.random.Generator, *, lumps: int) -> tuple[Array, Array]:
    """Centres (K, 3) and half extents (K, 3) of the foliage masses, around and up the crown with some disorder.

    The last two fill the crown's middle, so that no sky shows through it.
    """
    number = np.arange(lumps) + 0.5
    up = 1 - 2 * number / lumps + rng.uniform(-0.08, 0.08, lumps)
    turn = number * np.pi * (3 - np.sqrt(5)) + rng.uniform(-0.3, 0.3, lumps)
    across, rise = habit.crown[0] * height_m, habit.crown[1] * height_m
    radii = habit.lump * height_m * rng.uniform(0.8, 1.25, lumps)
    if habit.taper == 1.0:
        radii = radii * (1.35 - 0.75 * (up + 1) / 2)
    flat = np.sqrt(np.maximum(1 - up**2, 0)) if habit.taper < 1 else np.ones(lumps)
    narrow = 1 - habit.taper * (up + 1) / 2 * 0.95
    reach = np.maximum(across * flat * narrow * rng.uniform(0.85, 1.1, lumps) - radii * 0.75, 0.0)
    height = habit.centre * height_m + np.clip(up, -0.95, 1.0) * np.maximum(rise - radii * 0.7, 0.1)
    shell = np.stack([np.cos(turn) * reach, np.sin(turn) * reach, height], 1)
    squash = np.array([1.0, 1.0, 0.62 if habit.taper == 1.0 else 0.85])
    core = np.array([(0.0, 0.0, habit.centre * height_m + sign * rise * 0.3) for sign in (-1, 1)])
    core_radii = np.array([[across * 0.62, across * 0.62, rise * 0.5], [across * 0.5, across * 0.5, rise * 0.42]])
    if habit.taper == 1.0:
        core_radii = core_radii * [[0.8, 0.8, 1.0], [0.5, 0.5, 1.0]]
    return np.concatenate([shell, core]), np.concatenate([radii[:, None] * squash, core_radii])


def _wood(sink: Sink, habit: Species, height_m: float, centres: Array, *, near: bool, rng: np.random.Generator) -> None:
    segments = 8 if near else 4
    top = habit.centre * height_m + habit.crown[1] * height_m * 0.4
    levels = np.array([0.0, 0.04, 0.2, 0.5, 0.8, 1.0]) if near else np.array([0.0, 1.0])
    sway = rng.uniform(-1, 1, (len(levels), 2)) * habit.trunk * height_m * np.minimum(levels * 3, 1)[:, None]
    path = np.column_stack([sway, levels * top])
    flare = np.where(levels == 0, 1.45, 1.0)
    radii = habit.trunk * height_m * (1 - 0.75 * levels) * flare
    _bark_tube(sink, path, radii, segments)
    if not near:
        return
    fork = (habit.centre - habit.crown[1]) * height_m
    for centre in centres[:9]:
        start_z = max(fork * 0.92, centre[2] - np.hypot(centre[0], centre[1]) * 1.3 - 0.3)
        start = np.array([0.0, 0.0, min(start_z, top * 0.95)])
        middle = start * 0.5 + centre * 0.5 + (0, 0, -0.06 * height_m * 0.5)
        thick = habit.trunk * height_m * 0.42
        _bark_tube(sink, np.stack([start, middle, centre]), np.array([thick, thick * 0.6, thick * 0.2]), 4)


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
