"""Trees, shrubs, hedges, grass and planters: leaves are geometry, nothing is cut out of a texture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.kit.leaves import lump, scatter_leaves
from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder, ring_faces, sweep
from authoring.materials.registry import MATERIALS

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
        foliage="foliage_green", crown=(0.37, 0.33), centre=0.65, lumps=30, lump=0.125, leaves=1500, leaf_m=0.30, trunk=0.026
    ),
    "columnar": Species(
        foliage="foliage_light", crown=(0.14, 0.42), centre=0.55, lumps=26, lump=0.082, leaves=1500, leaf_m=0.24, trunk=0.016
    ),
    "street": Species(
        foliage="foliage_olive", crown=(0.26, 0.28), centre=0.68, lumps=24, lump=0.105, leaves=1500, leaf_m=0.24, trunk=0.017
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


def tree(species: str, height_m: float, rng: np.random.Generator, *, lod: str = "near") -> list[Part]:
    """One tree on the ground at the origin, all of it labelled vegetation.

    Args:
        species: of `SPECIES`.
        height_m: to the top of the crown, at least 2.
        rng: decides branches and leaves.
        lod: `near` for about 3 to 4 thousand triangles, `far` for about 300.
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
    for centre, radius in zip(centres, radii, strict=True):
        lump(sink, habit.foliage, centre, radius, around=middle, detail=0, rng=rng)
    length_m = habit.leaf_m * (height_m / 8) ** 0.5
    layers = ((0.42, 1.9, (0.75, 1.0)), (0.58, 0.8, (0.85, 1.15))) if near else ((0.035, 4.0, (0.7, 0.95)),)
    for share, size, reach in layers:
        scatter_leaves(
            sink,
            habit.foliage,
            centres,
            radii,
            count=round(habit.leaves * share),
            length_m=length_m * size,
            around=middle,
            reach=reach,
            rng=rng,
        )
    return sink.parts()


def shrub(height_m: float, rng: np.random.Generator, *, foliage: str = "foliage_green") -> list[Part]:
    """A round bush on the ground at the origin, a little wider than high."""
    sink = Sink("vegetation")
    _bush(sink, np.zeros(3), height_m, foliage, rng=rng)
    return sink.parts()


def hedge(length_m: float, height_m: float, depth_m: float, rng: np.random.Generator) -> list[Part]:
    """A clipped hedge along x, centred at the origin."""
    sink = Sink("vegetation")
    step = 0.45
    columns = max(3, round(length_m / step) + 1)
    # A cross-section from the foot of the front over the top to the foot of the back.
    half = depth_m / 2
    outline = np.array(
        [(-half, 0), (-half, height_m * 0.5), (-half, height_m - 0.08), (-half + 0.08, height_m), (half - 0.08, height_m), (half, height_m - 0.08), (half, height_m * 0.5), (half, 0)]
    )
    along = np.linspace(-length_m / 2, length_m / 2, columns)
    points = np.zeros((columns, len(outline), 3))
    points[..., 0] = along[:, None]
    points[..., 1:] = outline
    points[:, 1:-1] += rng.uniform(-0.05, 0.05, points[:, 1:-1].shape)
    _sheet(sink, "foliage_dark", points)
    for end, order in ((points[0], -1), (points[-1], 1)):
        ring = end[::order]
        tile_m = MATERIALS["foliage_dark"].tile_m
        normal = np.tile([float(order), 0.0, 0.0], (len(ring), 1))
        faces = [(0, i, i + 1) for i in range(1, len(ring) - 1)]
        sink.triangles("foliage_dark", ring, faces, uvs=ring[:, 1:] / tile_m, normals=normal)
    _hedge_leaves(sink, length_m, height_m, depth_m, rng)
    return sink.parts()


def grass_tufts(area_m: tuple[float, float], count: int, rng: np.random.Generator) -> list[Part]:
    """Tufts of blades spread over a rectangle around the origin; label terrain, as the lawn they grow from."""
    sink = Sink("terrain")
    foot = rng.uniform(-0.5, 0.5, (count, 1, 2)) * area_m
    blades = 7
    angle = rng.uniform(0, 2 * np.pi, (count, blades))
    lean = rng.uniform(0.1, 0.6, (count, blades))
    tall = rng.uniform(0.08, 0.24, (count, blades))
    direction = np.stack([np.cos(angle), np.sin(angle)], -1)
    across = np.stack([-direction[..., 1], direction[..., 0]], -1)
    base = foot + direction * 0.03
    corners = np.zeros((count, blades, 3, 3))
    corners[..., 0, :2] = base - across * 0.012
    corners[..., 1, :2] = base + across * 0.012
    corners[..., 2, :2] = base + direction * (lean * tall)[..., None]
    corners[..., 2, 2] = tall
    points = corners.reshape(-1, 3)
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    faces = np.arange(len(points)).reshape(-1, 3)
    uvs = points[:, :2] / MATERIALS["grass"].tile_m
    sink.triangles("grass", points, faces, uvs=uvs, normals=normals)
    sink.triangles("grass", points, faces[:, ::-1], uvs=uvs, normals=normals)
    return sink.parts()


def planter(kind: str, rng: np.random.Generator) -> list[Part]:
    """A planted container: `box` (concrete, 1.6 m), `round` (1 m), `wood` (1.2 m). Bushes and flowers inside."""
    sink = Sink("vegetation")
    if kind == "round":
        cylinder(sink, "concrete_light", (0, 0, 0), 0.42, 0.55, top_radius_m=0.52, segments=18, cap=False, label="static")
        cylinder(sink, "earth", (0, 0, 0.5), 0.5, 0.0005, segments=14, label="static")
        half_w, half_d, top = 0.35, 0.35, 0.5
    elif kind in ("box", "wood"):
        half_w, half_d, top = (0.8, 0.35, 0.55) if kind == "box" else (0.6, 0.3, 0.5)
        swatch = "concrete_light" if kind == "box" else "weathered_wood"
        sink.swatch_box(swatch, (-half_w, -half_d, 0), (half_w, half_d, top), skip="zZ", label="static")
        rim = 0.05
        for low, high in (
            ((-half_w, -half_d), (half_w, -half_d + rim)),
            ((-half_w, half_d - rim), (half_w, half_d)),
            ((-half_w, -half_d + rim), (-half_w + rim, half_d - rim)),
            ((half_w - rim, -half_d + rim), (half_w, half_d - rim)),
        ):
            sink.swatch_box(swatch, (*low, top - 0.08), (*high, top), skip="z", label="static")
        sink.swatch_quad(
            "earth",
            [(-half_w, -half_d, top - 0.07), (half_w, -half_d, top - 0.07), (half_w, half_d, top - 0.07), (-half_w, half_d, top - 0.07)],
            label="static",
        )
    else:
        raise ValueError(f"no planter named {kind!r}; there are box, round, wood")
    for x in np.linspace(-half_w * 0.6, half_w * 0.6, 1 if kind == "round" else 3):
        _bush(sink, np.array([x, 0.0, top - 0.15]), float(rng.uniform(0.45, 0.7)), "foliage_green", rng=rng, leaves=150)
    flower = str(rng.choice(["flower_red", "flower_pink", "flower_yellow", "flower_white"]))
    for x, y, z in rng.uniform(-1, 1, (14, 3)) * (half_w * 0.85, half_d * 0.85, 0.12) + (0, 0, top + 0.18):
        sink.swatch_box(flower, (x - 0.03, y - 0.03, z), (x + 0.03, y + 0.03, z + 0.04), skip="z")
    return sink.parts()


def _hedge_leaves(sink: Sink, length_m: float, height_m: float, depth_m: float, rng: np.random.Generator) -> None:
    """Leaves all over a clipped box, thickest along its top."""
    count = int(length_m * (2 * height_m + depth_m) * 55)
    half = np.array([length_m / 2, depth_m / 2, height_m / 2])
    at = rng.uniform(-1, 1, (count, 3)) * (half - 0.03)
    # Each leaf is pushed to the front, the back or the top, by the areas of the three.
    face = rng.choice(3, size=count, p=np.array([height_m, height_m, depth_m * 1.5]) / (2 * height_m + depth_m * 1.5))
    at[face == 0, 1], at[face == 1, 1], at[face == 2, 2] = -half[1], half[1], half[2]
    inward = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])[face]
    at += (0, 0, half[2])
    scatter_leaves(
        sink,
        "foliage_dark",
        at,
        np.full((count, 3), 0.02),
        count=count,
        length_m=0.13,
        around=at - inward,
        rng=rng,
    )


def _bush(
    sink: Sink, foot: Array, height_m: float, foliage: str, *, rng: np.random.Generator, leaves: int = 420
) -> None:
    angle = np.arange(5) * 2 * np.pi / 5 + rng.uniform(0, 1)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(5)], 1) * 0.3 + (0, 0, 0.36)
    shape = np.concatenate([ring, [[0.0, 0.0, 0.6]]]) + rng.uniform(-0.07, 0.07, (6, 3))
    centres = foot + shape * height_m
    radii = rng.uniform(0.28, 0.38, (6, 1)) * height_m * np.ones(3)
    around = foot + (0, 0, height_m * 0.2)
    for centre, radius in zip(centres, radii, strict=True):
        lump(sink, foliage, centre, radius, around=around, detail=0, rng=rng)
    length_m = 0.10 + 0.08 * height_m
    scatter_leaves(sink, foliage, centres, radii, count=leaves, length_m=length_m, around=around, rng=rng)


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


def _wood(
    sink: Sink, habit: Species, height_m: float, centres: Array, *, near: bool, rng: np.random.Generator
) -> None:
    segments = 9 if near else 4
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
    for centre in centres[: 9]:
        start_z = max(fork * 0.92, centre[2] - np.hypot(centre[0], centre[1]) * 1.3 - 0.3)
        start = np.array([0.0, 0.0, min(start_z, top * 0.95)])
        middle = start * 0.5 + centre * 0.5 + (0, 0, -0.06 * height_m * 0.5)
        thick = habit.trunk * height_m * 0.42
        _bark_tube(sink, np.stack([start, middle, centre]), np.array([thick, thick * 0.6, thick * 0.2]), 5)


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


def _sheet(sink: Sink, material: str, points: Array) -> None:
    """A smooth lattice (R, C, 3) whose outside is rows x columns by the right hand... seen from columns' left."""
    rows, columns = points.shape[:2]
    along = np.gradient(points, axis=0)
    across = np.gradient(points, axis=1)
    normals = np.cross(along, across)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    tile_m = MATERIALS[material].tile_m
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[0], axis=0), axis=1))])
    u = np.broadcast_to(points[..., 0] / tile_m, (rows, columns))
    v = np.broadcast_to(length / tile_m, (rows, columns))
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    sink.triangles(material, points.reshape(-1, 3), faces, uvs=np.stack([u, v], -1).reshape(-1, 2), normals=normals.reshape(-1, 3))
