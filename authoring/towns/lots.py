"""Buildings along the streets: lots cut greedily out of what the sidewalks and sites leave of a block."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely  # type: ignore[import-untyped]
from shapely.geometry import LineString, Point, Polygon  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.geometry.polygon import orient  # type: ignore[import-untyped]

from authoring.kit.buildings import FLOOR_M, building
from authoring.kit.parts import Sink, place
from authoring.towns import paths
from authoring.towns.lod import without_hidden_edges
from authoring.towns.regions import KERB_M, Regions

Array = npt.NDArray[np.float64]
NEAR_M = 232.0
# Styles by height with how often each comes: by age and purpose, and by how many triangles a town can carry.
TALL = {"glass_office": 0.45, "concrete_office": 0.35, "modern_residential": 0.2}
MIDDLE = {
    "brick_apartment": 0.27,
    "plaster_apartment": 0.2,
    "warehouse_loft": 0.2,
    "stone_classic": 0.12,
    "modern_residential": 0.11,
    "concrete_office": 0.1,
}
LOW = {"shop_row": 0.3, "brick_apartment": 0.25, "plaster_apartment": 0.2, "warehouse_loft": 0.25}
STREET_M = 0.6
# Buildings whose middles are farther apart do not touch.
REACH_M = 40.0


@dataclass(frozen=True, slots=True, eq=False)
class Lot:
    """One building's footprint (width along the street, depth away from it) and what stands on it."""

    centre: tuple[float, float]
    yaw_rad: float
    width_m: float
    depth_m: float
    floors: int
    style: str
    sides: tuple[str, ...]
    near: bool

    @property
    def footprint(self) -> Polygon:
        """The lot in the plane."""
        return _rectangle(np.asarray(self.centre), self.yaw_rad, self.width_m, self.depth_m)


def plan_lots(regions: Regions, sites: BaseGeometry, *, rng: np.random.Generator) -> list[Lot]:
    """Lots along every street-side rim of every block, corner to corner, none on a site."""
    lots: list[Lot] = []
    walked = shapely.union_all([regions.sidewalks, regions.level_roads, regions.corridors])
    street = walked.buffer(STREET_M)
    for interior in regions.interiors:
        taken: list[Polygon] = []
        free = interior.difference(sites).difference(regions.canal.buffer(5.0))
        shapely.prepare(free)
        for ring in (orient(interior).exterior, *orient(interior).interiors):
            line = np.asarray(ring.simplify(0.05).coords)[:, :2]
            lots.extend(_along(line, free, street, walked, taken, rng=rng))
    return lots


def build_lots(sink: Sink, lots: list[Lot], *, seed: int) -> None:
    """Put the buildings on their lots; each is drawn from a generator of its own."""
    for index, lot in enumerate(lots):
        parts = building(
            style=lot.style,
            width_m=lot.width_m,
            depth_m=lot.depth_m,
            floors=lot.floors,
            rng=np.random.default_rng([seed, index]),
            sides=lot.sides,
            lod="near" if lot.near else "far",
            covered_m=_covered(lot, lots) if lot.near else None,
        )
        if lot.near:
            parts = without_hidden_edges(parts, lot.width_m, lot.depth_m)
        x, y = lot.centre
        sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=lot.yaw_rad))


def _covered(lot: Lot, lots: list[Lot]) -> dict[str, float]:
    """Up to which height a neighbour stands right before all of the left and the right side of a building."""
    cos, sin = np.cos(lot.yaw_rad), np.sin(lot.yaw_rad)
    near = [other for other in lots if other is not lot and np.hypot(*np.subtract(other.centre, lot.centre)) < REACH_M]
    found = {}
    for side, u in (("left", -lot.width_m / 2 - 0.35), ("right", lot.width_m / 2 + 0.35)):
        heights = []
        for v in np.array([-0.47, -0.16, 0.16, 0.47]) * lot.depth_m:
            point = Point(lot.centre[0] + cos * u - sin * v, lot.centre[1] + sin * u + cos * v)
            before = [other.floors - (other.style == "shop_row") for other in near if other.footprint.contains(point)]
            heights.append(max(before, default=0) * FLOOR_M)
        found[side] = float(min(heights))
    return found


def _along(
    line: Array,
    free: BaseGeometry,
    street: BaseGeometry,
    walked: BaseGeometry,
    taken: list[Polygon],
    *,
    rng: np.random.Generator,
) -> Iterator[Lot]:
    total, station = paths.length(line), 0.0
    while station < total - 7.0:
        start = paths.at(line, station)[0]
        if not street.contains(Point(*start)):
            station += 3.0
            continue
        far = bool(np.abs(start).max() > NEAR_M)
        wish = float(rng.uniform(20, 34) if far else rng.uniform(15, 27))
        deep = float(rng.uniform(11.5, 16.5))
        for width, depth in ((wish, deep), (wish * 0.7, deep), (wish * 0.7, deep * 0.75), (8.0, 9.0)):
            lot = _fit(line, station, total, width, depth, free, street, taken)
            if lot is not None:
                taken.append(_rectangle(lot[0], lot[1], width, depth))
                yield _designed(lot[0], lot[1], width, depth, walked, rng=rng)
                gap = float(rng.uniform(2.5, 4.5)) if rng.random() < 0.12 else 0.0
                station += width + gap
                break
        else:
            station += 1.0


def _fit(
    line: Array,
    station: float,
    total: float,
    width: float,
    depth: float,
    free: BaseGeometry,
    street: BaseGeometry,
    taken: list[Polygon],
) -> tuple[Array, float] | None:
    if station + width > total:
        return None
    a, b = paths.at(line, station)[0], paths.at(line, station + width)[0]
    chord = float(np.linalg.norm(b - a))
    if chord < 0.985 * width or not street.contains(LineString([a, b])):
        return None
    along = (b - a) / chord
    inward = np.array([-along[1], along[0]])
    centre = (a + b) / 2 + inward * (depth / 2 + _bulge(line, station, width, inward, a) + 0.05)
    yaw = float(np.arctan2(along[1], along[0]))
    shape = _rectangle(centre, yaw, width, depth)
    if not free.contains(shape.buffer(-0.12)):
        return None
    core = shape.buffer(-0.08)
    return None if any(core.intersects(other) for other in taken) else (centre, yaw)


def _bulge(line: Array, station: float, width: float, inward: Array, a: Array) -> float:
    """How far the rim comes into the lot between its corners."""
    piece = paths.cut(line, station, station + width)
    return float(max(((piece - a) @ inward).max(), 0.0))


def _designed(
    centre: Array, yaw: float, width: float, depth: float, walked: BaseGeometry, *, rng: np.random.Generator
) -> Lot:
    x, y = float(centre[0]), float(centre[1])
    near = max(abs(x), abs(y)) < NEAR_M
    distance = float(np.hypot(x - 10, y - 60))
    draw = float(rng.random())
    height = (13.0 * np.exp(-((distance / 110) ** 2)) + 4.0) * (0.45 + 0.9 * draw)
    floors = int(np.clip(round(height), 3, 20))
    if width < 10:
        floors = min(floors, 6)
    palette = TALL if floors >= 9 else MIDDLE if floors >= 5 else LOW
    style = str(rng.choice(list(palette), p=list(palette.values())))
    sides = ["front"]
    cos, sin = np.cos(yaw), np.sin(yaw)
    reach = {"right": (width / 2 + 2, 0.0), "back": (0.0, depth / 2 + 2), "left": (-width / 2 - 2, 0.0)}
    for side, (u, v) in reach.items():
        if walked.contains(Point(x + cos * u - sin * v, y + sin * u + cos * v)):
            sides.append(side)
    return Lot(
        (round(x, 3), round(y, 3)), round(yaw, 5), round(width, 2), round(depth, 2), floors, style, tuple(sides), near
    )


def _rectangle(centre: Array, yaw: float, width: float, depth: float) -> Polygon:
    cos, sin = np.cos(yaw), np.sin(yaw)
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (width / 2, depth / 2)
    return Polygon(corners @ np.array([[cos, sin], [-sin, cos]]) + centre)
