"""The suburb's horizon: meadows that rise into hills, houses on the slopes, hedgerows and woods."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely  # type: ignore[import-untyped]
from shapely.geometry import Point  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring.kit.gardens import clump
from authoring.kit.houses import far_house
from authoring.kit.parts import Sink, place
from authoring.towns.regions import KERB_M
from authoring.towns.suburb import FLAT_M

Array = npt.NDArray[np.float64]
REACH_M = 1150.0
TILE_M = {"grass": 41.0, "foliage_dark": 23.0}
HOUSES_M = (196.0, 560.0)
ANGLES, RADII = 145, 20


def height(x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
    """Height of the land: level in town, then slopes, then hills whose ridges are sums of a few waves."""
    px, py = np.asarray(x, np.float64), np.asarray(y, np.float64)
    away = np.maximum(np.abs(px), np.abs(py))
    r, theta = np.hypot(px, py), np.arctan2(py, px)
    near = np.clip((away - FLAT_M) / 260.0, 0, 1)
    far = np.clip((r - 430.0) / (REACH_M - 430.0), 0, 1)
    ridge = 0.6 + 0.3 * np.sin(3 * theta + 1.1) + 0.22 * np.sin(5 * theta + 4.2 + far)
    ridge = ridge + 0.14 * np.sin(9 * theta + 0.4 + 2 * far) + 0.08 * np.sin(17 * theta + 2.0)
    slope = 13.0 * near**1.5 * (0.75 + 0.5 * np.sin(2 * theta + 0.8))
    return np.asarray(KERB_M - 0.02 + slope + 95.0 * np.maximum(ridge, 0.2) * far**1.4)


def build_skyline(sink: Sink, keep_off: BaseGeometry, rng: np.random.Generator) -> None:
    """Add land, far houses, hedgerows and woods around the town."""
    _land(sink)
    shapely.prepare(keep_off)
    placed: list[tuple[float, float]] = []
    for _ in range(2600):
        r, theta = float(np.sqrt(rng.uniform(HOUSES_M[0] ** 2, HOUSES_M[1] ** 2))), float(rng.uniform(0, 2 * np.pi))
        x, y = r * np.cos(theta), r * np.sin(theta)
        seed = int(rng.integers(1 << 30))
        if len(placed) >= 130 or keep_off.intersects(Point(x, y).buffer(9.0)):
            continue
        if placed and np.hypot(*(np.asarray(placed) - (x, y)).T).min() < 21.0:
            continue
        placed.append((x, y))
        yaw = theta - np.pi / 2 + float(rng.normal(0, 0.3))
        parts = far_house(np.random.default_rng([35, seed]))
        sink.extend(place(parts, x_m=x, y_m=y, z_m=float(height(x, y)), yaw_rad=yaw))
    trees = Sink("vegetation")
    count = 0
    for _ in range(3000):
        r, theta = float(rng.uniform(178.0, 900.0)), float(rng.uniform(0, 2 * np.pi))
        x, y, tall = r * np.cos(theta), r * np.sin(theta), float(rng.uniform(7, 12) * (1 + r / 900))
        if count >= 260 or keep_off.intersects(Point(x, y).buffer(0.55 * tall + 2.0)):
            continue
        if placed and np.hypot(*(np.asarray(placed) - (x, y)).T).min() < 6.0 + 0.4 * tall:
            continue
        count += 1
        clump(trees, x, y, float(height(x, y)) - 0.3, tall, rng)
    sink.extend(trees.parts())


def _land(sink: Sink) -> None:
    """The slopes and hills from the rim of the level ground outwards."""
    theta = np.linspace(0, 2 * np.pi, ANGLES)
    rim = FLAT_M / np.maximum(np.abs(np.cos(theta)), np.abs(np.sin(theta)))
    share = np.linspace(0, 1, RADII) ** 1.3
    r = rim[:, None] + (REACH_M - rim[:, None]) * share
    x, y = r * np.cos(theta)[:, None], r * np.sin(theta)[:, None]
    grid = np.stack([x, y, height(x, y)], -1)
    grid[-1] = grid[0]
    du, dv = np.gradient(grid, axis=0), np.gradient(grid, axis=1)
    du[0] = du[-1] = (grid[1] - grid[-2]) / 2
    normals = np.cross(dv, du)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    index = np.arange(ANGLES * RADII).reshape(ANGLES, RADII)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    turn = theta[:, None] + 0 * r
    pattern = np.sin(7 * turn + 3 * np.sin(9 * share)) + np.sin(19 * turn + 1.7) + 0.9 * np.sin(0.021 * r + 2 * turn)
    woods = np.repeat(((pattern > 0.3) & (share > 0.18))[:-1, :-1].ravel()[None], 2, 0).ravel()
    vertices = grid.reshape(-1, 3)
    if np.cross(vertices[b[0]] - vertices[a[0]], vertices[c[0]] - vertices[a[0]])[2] > 0:
        faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    normals = np.where(normals[..., 2:] < 0, -normals, normals)
    for chosen, material, label in ((~woods, "grass", "terrain"), (woods, "foliage_dark", "vegetation")):
        uvs = vertices[:, :2] / TILE_M[material]
        sink.triangles(material, vertices, faces[chosen], uvs=uvs, normals=normals.reshape(-1, 3), label=label)
