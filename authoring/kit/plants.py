"""Low plants: shrubs, hedges, tufts of grass, planters."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from authoring.kit.leaves import lump, on_masses, scatter_leaves
from authoring.kit.parts import Part, Sink
from authoring.kit.shapes import cylinder
from authoring.materials.registry import MATERIALS

Array = npt.NDArray[np.float64]


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
        [
            (-half, 0),
            (-half, height_m * 0.5),
            (-half, height_m - 0.08),
            (-half + 0.08, height_m),
            (half - 0.08, height_m),
            (half, height_m - 0.08),
            (half, height_m * 0.5),
            (half, 0),
        ]
    )
    along = np.linspace(-length_m / 2, length_m / 2, columns)
    points = np.zeros((columns, len(outline), 3))
    points[..., 0] = along[:, None]
    points[..., 1:] = outline
    points[:, 1:-1] += rng.uniform(-0.05, 0.05, points[:, 1:-1].shape)
    _sheet(sink, "foliage_dark", points)
    tile_m = MATERIALS["foliage_dark"].tile_m
    for end, towards in ((points[0], -1.0), (points[-1], 1.0)):
        ring = end if towards < 0 else end[::-1]
        normals = np.tile([towards, 0.0, 0.0], (len(ring), 1))
        faces = [(0, i, i + 1) for i in range(1, len(ring) - 1)]
        sink.triangles("foliage_dark", ring, faces, uvs=ring[:, 1:] / tile_m, normals=normals)
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
        cylinder(
            sink, "concrete_light", (0, 0, 0), 0.42, 0.55, top_radius_m=0.52, segments=18, cap=False, label="static"
        )
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
            [
                (-half_w, -half_d, top - 0.07),
                (half_w, -half_d, top - 0.07),
                (half_w, half_d, top - 0.07),
                (-half_w, half_d, top - 0.07),
            ],
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
    """Adds leaves on all faces of a clipped box, most of them along its top."""
    count = int(length_m * (2 * height_m + depth_m) * 55)
    half = np.array([length_m / 2, depth_m / 2, height_m / 2])
    at = rng.uniform(-1, 1, (count, 3)) * (half - 0.03)
    # Each leaf is pushed to the front, the back or the top, by the areas of the three.
    face = rng.choice(3, size=count, p=np.array([height_m, height_m, depth_m * 1.5]) / (2 * height_m + depth_m * 1.5))
    at[face == 0, 1], at[face == 1, 1], at[face == 2, 2] = -half[1], half[1], half[2]
    outward = np.array([(0.0, -1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])[face]
    outward += 0.5 * rng.normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    at += (0, 0, half[2])
    scatter_leaves(sink, "foliage_dark", at, outward, length_m=0.13, rng=rng)


def _bush(
    sink: Sink, foot: Array, height_m: float, foliage: str, *, rng: np.random.Generator, leaves: int = 420
) -> None:
    angle = np.arange(5) * 2 * np.pi / 5 + rng.uniform(0, 1)
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(5)], 1) * 0.3 + (0, 0, 0.36)
    shape = np.concatenate([ring, [[0.0, 0.0, 0.6]]]) + rng.uniform(-0.07, 0.07, (6, 3))
    centres = foot + shape * height_m
    radii = rng.uniform(0.28, 0.38, (6, 1)) * height_m * np.ones(3)
    around = foot + np.array([0.0, 0.0, height_m * 0.2])
    masses = [
        lump(sink, foliage, centre, radius, around=around, detail=0, rng=rng)
        for centre, radius in zip(centres, radii, strict=True)
    ]
    feet, outward = on_masses(masses, centres, radii, count=leaves, around=around, rng=rng)
    scatter_leaves(sink, foliage, feet, outward, length_m=0.10 + 0.08 * height_m, rng=rng)


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
    sink.triangles(
        material, points.reshape(-1, 3), faces, uvs=np.stack([u, v], -1).reshape(-1, 2), normals=normals.reshape(-1, 3)
    )
