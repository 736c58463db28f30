"""The horizon: distant blocks beyond the streets, fields, and hills out to a kilometre."""

from __future__ import annotations

import numpy as np
import shapely  # type: ignore[import-untyped]
from shapely.geometry import Point, box  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.kit.buildings import STYLES, building
from authoring.kit.parts import Sink, place
from authoring.towns import solids
from authoring.towns.lots import NEAR_M, Lot
from authoring.towns.regions import OUTER_M, Regions

PITCH_M = 56.0
CITY_M = 640.0
HILLS_M = (520.0, 1150.0)
HILL_TOP_M = 105.0
FIELD_Z_M = -0.12
HILL_TILE_M = {"grass": 57.0, "foliage_dark": 23.0}


def build_skyline(sink: Sink, regions: Regions, lots: list[Lot], *, rng: np.random.Generator) -> None:
    """Add far blocks wherever the outer town is empty, the fields around it and the hills behind."""
    solids.flat(
        sink,
        box(-720, -720, 720, 720).difference(box(-OUTER_M, -OUTER_M, OUTER_M, OUTER_M)),
        FIELD_Z_M,
        "grass",
        "terrain",
        cell_m=720.0,
    )
    build_hills(sink)
    taken = unary_union([regions.carriageways.buffer(9.0), regions.canal.buffer(9.0), *[lot.footprint for lot in lots]])
    shapely.prepare(taken)
    count = int(CITY_M / PITCH_M)
    for column in range(-count, count + 1):
        for row in range(-count, count + 1):
            x, y = (np.array([column, row]) + rng.uniform(-0.2, 0.2, 2)) * PITCH_M
            width, depth, draw = rng.uniform(20, 42), rng.uniform(16, 30), rng.random()
            yaw = float(rng.choice([0, 1, 2, 3])) * np.pi / 2 + float(rng.normal(0, 0.06))
            style = str(rng.choice(STYLES))
            seed = int(rng.integers(1 << 30))
            reach = float(np.hypot(width, depth)) / 2
            if max(abs(x), abs(y)) < NEAR_M + reach or np.hypot(x, y) > CITY_M:
                continue
            if taken.intersects(Point(x, y).buffer(reach)):
                continue
            floors = int(np.clip(3 + 15 * draw**2.2, 2, 18))
            parts = building(
                style=style,
                width_m=round(float(width), 1),
                depth_m=round(float(depth), 1),
                floors=floors,
                rng=np.random.default_rng(seed),
                lod="far",
            )
            sink.extend(place(parts, x_m=float(x), y_m=float(y), z_m=-0.1, yaw_rad=yaw))


def build_hills(sink: Sink) -> None:
    """A ring of hills, heights summed from a few waves so that no two ridges are alike."""
    angles = np.linspace(0, 2 * np.pi, 163)
    radii = np.concatenate([np.linspace(*HILLS_M, 15)])
    theta, r = np.meshgrid(angles, radii, indexing="ij")
    rise = np.clip((r - HILLS_M[0]) / (HILLS_M[1] - HILLS_M[0]), 0, 1)
    waves = [(3, 0.4, 0.30), (5, 2.1, 0.25), (8, 4.0, 0.18), (13, 1.2, 0.12), (21, 5.5, 0.07)]
    ridge = 0.62 + sum(a * np.sin(k * theta + p + 2.5 * rise * np.sin(k + p)) for k, p, a in waves)
    height = FIELD_Z_M + HILL_TOP_M * np.maximum(ridge, 0.18) * rise**1.6
    grid = np.stack([r * np.cos(theta), r * np.sin(theta), height], -1)
    grid[-1] = grid[0]
    du, dv = np.gradient(grid, axis=0), np.gradient(grid, axis=1)
    du[0] = du[-1] = (grid[1] - grid[-2]) / 2
    normals = np.cross(dv, du)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rows, columns = theta.shape
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    wooded = (
        np.sin(7 * theta + 3 * np.sin(9 * rise)) + np.sin(23 * theta + 1.7) + 0.8 * np.sin(31 * rise + theta) > 0.35
    )
    woods = np.repeat((wooded & (rise > 0.12))[:-1, :-1].ravel()[None], 2, 0).ravel()
    vertices = grid.reshape(-1, 3)
    for chosen, material, label in ((~woods, "grass", "terrain"), (woods, "foliage_dark", "vegetation")):
        sink.triangles(
            material,
            vertices,
            faces[chosen],
            uvs=vertices[:, :2] / HILL_TILE_M[material],
            normals=normals.reshape(-1, 3),
            label=label,
        )
