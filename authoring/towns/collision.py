"""Collision geoms of a town, which are never rendered: boxes under roads and sidewalks, and boxes in buildings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Polygon  # type: ignore[import-untyped]
from shapely.geometry.polygon import orient  # type: ignore[import-untyped]

from authoring.towns import bridges, solids
from authoring.towns.lots import Lot
from authoring.towns.regions import KERB_M, Regions, polygons

Array = npt.NDArray[np.float64]
STRIP_M = 5.2
BASE_M = 0.5
REACH_M = 240.0


@dataclass(frozen=True, slots=True)
class Solid:
    """A collision geom: type, centre, sizes and orientation as MJCF has them."""

    name: str
    kind: str
    centre: tuple[float, float, float]
    size: tuple[float, ...]
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


def town_solids(regions: Regions, lots: Iterable[Lot], *, reach_m: float = REACH_M) -> Iterator[Solid]:
    """All collision geoms of streets, blocks, bridges and buildings, sidewalks as far out as `reach_m`."""
    yield Solid("ground.road", "plane", (0.0, 0.0, 0.0), (500.0, 500.0, 1.0))
    for index, land in enumerate(regions.blocks):
        for rim in solids.boundary_towards(land, regions.level_roads):
            yield from _strips(f"ground.sidewalk_{index}", rim, reach_m)
    for name, median in regions.medians.items():
        yield from _around(f"ground.median_{name}", median)
    for street in regions.network.streets.values():
        if street.hump_m:
            for slab in bridges.slabs(regions.network, street):
                yield Solid(slab.name, "box", slab.centre, slab.half, _turned(slab.yaw_rad, slab.slope))
    for index, lot in enumerate(lots):
        if np.abs(lot.centre).max() < REACH_M + 20:
            half = (lot.width_m / 2, lot.depth_m / 2, lot.floors * 1.7)
            centre = (*lot.centre, lot.floors * 1.7)
            yield Solid(f"building_{index}", "box", centre, half, _turned(lot.yaw_rad))


def level_box(name: str, footprint: Polygon, top_m: float) -> Solid:
    """The box under a rectangle's least rotated bounding rectangle, up to a height."""
    corners = np.asarray(orient(footprint.minimum_rotated_rectangle).exterior.coords)[:4, :2]
    along, across = corners[1] - corners[0], corners[3] - corners[0]
    centre = corners.mean(0)
    half = (float(np.linalg.norm(along)) / 2, float(np.linalg.norm(across)) / 2, BASE_M / 2)
    yaw = float(np.arctan2(along[1], along[0]))
    return Solid(name, "box", (float(centre[0]), float(centre[1]), top_m - BASE_M / 2), half, _turned(yaw))


def _strips(name: str, rim: Array, reach_m: float) -> Iterator[Solid]:
    """Boxes along a kerb, the land on its left; where the rim turns away they reach into the gap."""
    rim = np.asarray(LineString(rim).simplify(0.02).coords)
    steps = np.diff(rim, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    is_ring = bool(np.allclose(rim[0], rim[-1]))
    for index in np.flatnonzero(lengths > 0.05):
        start, along = rim[index], steps[index] / lengths[index]
        inward = np.array([-along[1], along[0]])
        low, high = 0.0, float(lengths[index])
        before, after = steps[index - 1], steps[(index + 1) % len(steps)]
        if (is_ring or index + 1 < len(steps)) and along[0] * after[1] - along[1] * after[0] < 0:
            high += min(STRIP_M * _half_turn(steps[index], after) * 2, 2.5)
        if (is_ring or index > 0) and before[0] * along[1] - before[1] * along[0] < 0:
            low -= min(STRIP_M * _half_turn(before, steps[index]) * 2, 2.5)
        while high - low > 0.02:
            piece = min(high - low, 60.0)
            centre = start + along * (low + piece / 2) + inward * STRIP_M / 2
            if np.abs(centre).max() < reach_m:
                yield Solid(
                    f"{name}_{centre[0]:.1f}_{centre[1]:.1f}_{np.degrees(np.arctan2(along[1], along[0])):.0f}",
                    "box",
                    (float(centre[0]), float(centre[1]), KERB_M - BASE_M / 2),
                    (piece / 2, STRIP_M / 2, BASE_M / 2),
                    _turned(float(np.arctan2(along[1], along[0]))),
                )
            low += piece


def _around(name: str, shape: Polygon) -> Iterator[Solid]:
    """A few level boxes that cover a long thin strip."""
    for index, piece in enumerate(polygons(shape)):
        yield level_box(f"{name}_{index}", piece, KERB_M)


def _half_turn(a: Array, b: Array) -> float:
    cosine = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
    return float(np.tan(np.arccos(np.clip(cosine, -1, 1)) / 2))


def _turned(yaw_rad: float, slope: float = 0.0) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of a turn about z after a pitch that lifts the front by `slope`."""
    pitch = -float(np.arctan(slope))
    cy, sy, cp, sp = np.cos(yaw_rad / 2), np.sin(yaw_rad / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    return float(cy * cp), float(-sy * sp), float(cy * sp), float(sy * cp)
