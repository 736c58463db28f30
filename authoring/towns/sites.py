"""Open places in the blocks: plaza, park with a hill, parking lot, vacant lots, a construction site."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Point, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit.parts import Part, Sink, place
from authoring.towns import paths, solids
from authoring.towns.collision import Solid, level_box
from authoring.towns.furniture import Furnisher
from authoring.towns.markings import paint_bay
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, Regions, polygons
from authoring.towns.signage import RAIL_HALF_M, barrier

Array = npt.NDArray[np.float64]
Kind = Literal["plaza", "park", "parking_lot", "vacant", "construction"]
LOT_BAY_M = (5.0, 2.5)
HILL_STEP_M = 1.5
PATH_M = 2.6
# A strip of grass between a parking lot and its street.
VERGE_M = 1.8
# An edge of a lot at most so far from a sidewalk is its front.
STREET_SIDE_M = 3.0
YARD_WALLS = ("brick_brown", "brick_red")
# Length of a low wall on a square, and of the way between two.
SEAT_M = (5.6, 3.4)
WALL_HALF_M = 0.2
# Trees farther from every road are simple ones.
NEAR_ROAD_M = 12.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """An open place: what it is and its corners; it takes what they cover of a block's inside."""

    name: str
    kind: Kind
    corners: Sequence[tuple[float, float]]

    def ground(self, regions: Regions) -> BaseGeometry:
        """What it takes of the inside of the blocks, clear of the canal's coping."""
        inside = unary_union(list(regions.interiors)).difference(regions.canal.buffer(0.6, join_style="mitre"))
        return Polygon(self.corners).intersection(inside)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hill:
    """A hill that is the cap of a sphere, so that a sphere carries exactly what is seen."""

    centre: tuple[float, float]
    radius_m: float
    height_m: float

    @property
    def sphere_m(self) -> float:
        """Radius of the sphere."""
        return (self.radius_m**2 + self.height_m**2) / (2 * self.height_m)

    def height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> Array:
        """Height of the ground, the level ground around it included."""
        away = (np.asarray(x) - self.centre[0]) ** 2 + (np.asarray(y) - self.centre[1]) ** 2
        base = KERB_M + self.height_m - self.sphere_m
        return np.asarray(np.maximum(KERB_M, base + np.sqrt(np.maximum(self.sphere_m**2 - away, 0))))


class SiteBuilder:
    """Builds sites with the same props as the streets."""

    def __init__(
        self, props: Props, regions: Regions, furnisher: Furnisher, hill: Hill, *, rng: np.random.Generator
    ) -> None:
        self.props, self.regions, self.furnisher, self.hill, self.rng = props, regions, furnisher, hill, rng
        self.sink = props.sink
        self.lot_bays: list[tuple[str, float, float, Array]] = []

    def build(self, site: Site) -> None:
        """Build one site."""
        ground = site.ground(self.regions)
        makers = {
            "plaza": self._plaza,
            "park": self._park,
            "parking_lot": self._parking_lot,
            "vacant": self._vacant,
            "construction": self._construction,
        }
        makers[site.kind](site, ground)
        for index, piece in enumerate(polygons(ground, min_area_m2=5)):
            self.props.solids.append(level_box(f"ground.{site.name}_{index}", piece, KERB_M))

    def _plaza(self, site: Site, ground: BaseGeometry) -> None:
        solids.flat(self.sink, ground, KERB_M, "cobbles", "sidewalk", cell_m=55.0)
        self._seats(ground)
        x0, y0, x1, y1 = ground.bounds
        for x in np.arange(x0 + 5, x1 - 3, 8.5):
            for y in np.arange(y0 + 4, y1 - 3, 8.5):
                px, py = (float(v) for v in np.array([x, y]) + self.rng.uniform(-0.6, 0.6, 2))
                if not ground.buffer(-2.5).contains(Point(px, py)):
                    continue
                edge = ground.exterior.distance(Point(px, py)) if hasattr(ground, "exterior") else 5.0
                if edge < 6.5:
                    self._tree(px, py, 2)
                elif self.rng.random() < 0.3:
                    self._put("cafe", kit.cafe(self.rng), px, py, 1.3, 1.2)
                elif self.rng.random() < 0.25:
                    self._put("planter_round", kit.planter("round", self.rng), px, py, 0.6, 0.8)
                elif self.rng.random() < 0.25:
                    self._put("bench_stone", kit.bench(style="stone"), px, py, 0.9, 0.6)
        self._put("pillar", kit.advertising_pillar(self.rng), (x0 + x1) / 2 + 6, y1 - 6, 0.7, 3.4)

    def _park(self, site: Site, ground: BaseGeometry) -> None:
        x0, y0, x1, y1 = ground.bounds
        middle = (y0 + y1) / 2
        wave = np.array([(x, middle + 7 * np.sin(x / 17) - 2) for x in np.arange(x0 - 2, x1 + 2, 2.0)])
        hx, hy = self.hill.centre
        ring_m = self.hill.radius_m + 3.0
        trail = LineString(wave).difference(Point(hx, hy).buffer(ring_m)).buffer(PATH_M / 2)
        ring = (
            Point(hx, hy)
            .buffer(ring_m + PATH_M / 2, quad_segs=16)
            .difference(Point(hx, hy).buffer(ring_m - PATH_M / 2, quad_segs=16))
        )
        tracks = unary_union([trail, ring]).intersection(ground)
        mound = Point(hx, hy).buffer(self.hill.radius_m, quad_segs=16)
        solids.flat(self.sink, ground.difference(tracks).difference(mound), KERB_M, "grass", "terrain")
        solids.flat(self.sink, tracks.difference(mound), KERB_M, "concrete", "sidewalk")
        self._mound()
        self.props.solids.append(
            Solid(
                "ground.hill",
                "sphere",
                (hx, hy, KERB_M + self.hill.height_m - self.hill.sphere_m),
                (self.hill.sphere_m,),
            )
        )
        inner = ground.buffer(-2.0)
        for _ in range(160):
            x, y = float(self.rng.uniform(x0, x1)), float(self.rng.uniform(y0, y1))
            if inner.contains(Point(x, y)) and not tracks.buffer(1.2).contains(Point(x, y)):
                if self.rng.random() < 0.8:
                    self._tree(x, y, int(self.rng.integers(6)), z=float(self.hill.height(x, y)), room_m=2.6)
                else:
                    shrub = kit.shrub(float(self.rng.uniform(0.8, 1.6)), self.rng)
                    self._put("shrub", shrub, x, y, 0.7, 1.0, z=float(self.hill.height(x, y)))
        for x in np.arange(x0 + 8, x1 - 8, 17.0):
            y = float(np.interp(x, wave[:, 0], wave[:, 1])) + 2.2
            if ground.contains(Point(x, y)) and not mound.buffer(5).contains(Point(x, y)):
                self._put("bench", kit.bench(style="wood"), float(x), y, 0.9, 0.8, yaw=0.0)
                self._put("lamp_heritage", kit.street_lamp(style="heritage"), float(x) + 2.5, y, 0.2, 4.0)
        hedge = kit.hedge(12.6, 0.9, 0.7, self.rng)
        for x in np.arange(x0 + 9, x1 - 9, 14.5):
            y = y0 + 1.0 + self._slack(ground, float(x), y0)
            if not self.props.is_free(float(x), y, 0.5):
                continue
            if round((float(x) - x0 - 9) / 14.5) % 3 == 2:
                line = np.array([(float(x) - 6.3, y), (float(x) + 6.3, y)])
                self._stretch(line, kit.wall(12.6, material="brick_brown", height_m=0.7), 0.9, half_m=WALL_HALF_M)
            else:
                self.props.instance("hedge", hedge, float(x), y, KERB_M, 0.0, radius_m=0.5, high_m=0.9)

    def _slack(self, ground: BaseGeometry, x: float, y0: float) -> float:
        column = ground.intersection(box(x - 0.2, y0 - 1, x + 0.2, y0 + 60))
        return float(column.bounds[1] - y0) if not column.is_empty else 0.0

    def _mound(self) -> None:
        hx, hy = self.hill.centre
        rings = np.linspace(0, self.hill.radius_m, int(self.hill.radius_m / HILL_STEP_M) + 1)
        angles = np.linspace(0, 2 * np.pi, 65)
        theta, r = np.meshgrid(angles, rings, indexing="ij")
        x, y = hx + r * np.cos(theta), hy + r * np.sin(theta)
        vertices = np.stack([x, y, self.hill.height(x, y)], -1).reshape(-1, 3)
        centre = np.array([hx, hy, KERB_M + self.hill.height_m - self.hill.sphere_m])
        normals = (vertices - centre) / np.linalg.norm(vertices - centre, axis=1, keepdims=True)
        rows, columns = theta.shape
        index = np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
        faces = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
        uvs = vertices[:, :2] / solids.tile_m_of("grass")
        self.sink.triangles("grass", vertices, faces, uvs=uvs, normals=normals, label="terrain")

    def _parking_lot(self, site: Site, ground: BaseGeometry) -> None:
        x0, y0, x1, y1 = ground.bounds
        way = (x0 + x1) / 2
        verge = ground.intersection(box(x0, y0, x1, y0 + VERGE_M)).difference(box(way - 4, y0, way + 4, y1))
        solids.flat(self.sink, ground.difference(verge), KERB_M, "asphalt_worn", "parking")
        solids.flat(self.sink, verge, KERB_M, "grass", "terrain")
        bays = []
        for y, yaw in ((y0 + 5.2, 90.0), (y1 - 4.2, -90.0)):
            for x in np.arange(x0 + 4, x1 - 4, LOT_BAY_M[1]):
                if ground.buffer(-0.1).contains(box(x - 1.25, y - 2.5, x + 1.25, y + 2.5)):
                    paint_bay(self.sink, float(x), y, np.radians(yaw), *LOT_BAY_M, z_m=KERB_M + 0.006)
                    bays.append((float(x), y, KERB_M, yaw))
        self.lot_bays.append((site.name, *LOT_BAY_M, np.asarray(bays)))
        for x in (x0 + 0.6, x1 - 0.6):
            self._fence(np.array([(x, y0 + 3.0), (x, y1 - 1.0)]), "bars", 1.2)
        self._fence(np.array([(x0 + 1, y1 - 0.6), (x1 - 1, y1 - 0.6)]), "wood", 1.6)

    def _vacant(self, site: Site, ground: BaseGeometry) -> None:
        for piece in polygons(ground, min_area_m2=10):
            solids.flat(self.sink, piece, KERB_M, "soil", "terrain")
            x0, y0, x1, y1 = piece.bounds
            tufts = kit.grass_tufts((x1 - x0 - 3, y1 - y0 - 3), 50, self.rng)
            self.sink.extend(place(tufts, x_m=(x0 + x1) / 2, y_m=(y0 + y1) / 2, z_m=KERB_M))
            for _ in range(3):
                x, y = float(self.rng.uniform(x0 + 2, x1 - 2)), float(self.rng.uniform(y0 + 2, y1 - 2))
                shrub = kit.shrub(float(self.rng.uniform(0.5, 1.1)), self.rng, foliage="foliage_olive")
                if piece.buffer(-1.2).contains(Point(x, y)) and not self.furnisher.ground.views.contains(Point(x, y)):
                    self._put("shrub", shrub, x, y, 0.5, 0.8)
            self._rim(site, piece)

    def _construction(self, site: Site, ground: BaseGeometry) -> None:
        solids.flat(self.sink, ground, KERB_M, "soil", "terrain")
        x0, y0, x1, y1 = ground.bounds
        cx, cy = (x0 + x1) / 2, (y0 + y1) / 2
        shell = Sink("building")
        for floor in range(3):
            z = 3.4 * floor
            for x in np.linspace(-13, 13, 5):
                for y in (-7.0, 0.0, 7.0):
                    if floor < 2 or x < 3:
                        shell.tiled_box(
                            "concrete", (x - 0.25, y - 0.25, z), (x + 0.25, y + 0.25, z + 3.1), tile_m=4.0, skip="z"
                        )
            shell.tiled_box("concrete", (-14, -8, z + 3.1), (14 if floor < 2 else 4, 8, z + 3.4), tile_m=4.0)
        self.sink.extend(place(shell.parts(), x_m=cx, y_m=cy + 2, z_m=KERB_M))
        self.props.solids.append(Solid(f"{site.name}_shell", "box", (cx, cy + 2, 5.0), (14.0, 8.0, 5.0)))
        self.props.spots.append((cx, cy + 2, 15.0))
        for index, x in enumerate((x0 + 8.0, x1 - 8.0)):
            container = Sink("static")
            swatch = ("dark_blue", "orange")[index]
            container.swatch_box(swatch, (-3.03, -1.22, 0.0), (3.03, 1.22, 2.6), skip="z")
            for rib in np.arange(-2.9, 2.91, 0.29):
                container.swatch_box(swatch, (rib, -1.27, 0.1), (rib + 0.14, -1.22, 2.5), skip="Yz")
            self._put("container", container.parts(), x, y0 + 5.0, 1.3, 2.6, yaw=0.0)
        self._hoarding(ground)
        for x in np.arange(x0 + 3, x1 - 3, 4.2):
            y = y0 + self._slack(ground, float(x), y0) + 1.2
            self._put("jersey", kit.jersey_barrier(3.0), float(x), y, 0.4, 0.8, yaw=0.0)

    def _rim(self, site: Site, ground: Polygon) -> None:
        """A railing towards the street, and the neighbours' walls on the other sides."""
        material = YARD_WALLS[sum(map(ord, site.name)) % len(YARD_WALLS)]
        for rim in self._edges(ground):
            if self.regions.sidewalks.distance(Point(*rim.mean(0))) < STREET_SIDE_M:
                solids.railing(self.sink, rim, KERB_M, "galvanised", "fence", top_m=1.1, post_m=2.5)
                barrier(self.props.solids, rim, 1.1)
            else:
                wall = kit.wall(paths.length(rim), material=material, height_m=1.9, thick_m=0.24)
                self._stretch(rim, wall, 2.0, half_m=WALL_HALF_M)

    def _seats(self, ground: BaseGeometry) -> None:
        """Low walls to sit on along the edges of a square, with ways between them."""
        for rim in self._edges(ground.buffer(-1.1)):
            total = paths.length(rim)
            for start in np.arange(2.0, total - SEAT_M[0] - 1.5, SEAT_M[0] + SEAT_M[1]):
                piece = paths.cut(rim, float(start), float(start) + SEAT_M[0])
                points = [(float(x), float(y)) for x, y in paths.densified(piece, 1.0)]
                if all(self.props.is_free(x, y, 0.5) for x, y in points):
                    self._stretch(piece[[0, -1]], kit.seat_wall(SEAT_M[0]), 0.5, half_m=WALL_HALF_M)
                    self.props.spots.extend((x, y, 0.9) for x, y in points)

    def _stretch(self, line: Array, parts: list[Part], height_m: float, *, half_m: float = RAIL_HALF_M) -> None:
        """A wall or a fence between two points (2, 2), visible and with collision geoms."""
        x, y = (float(v) for v in line.mean(0))
        yaw = float(np.arctan2(*(line[1] - line[0])[::-1]))
        self.sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=yaw))
        barrier(self.props.solids, line, height_m, half_m=half_m)

    def _hoarding(self, ground: BaseGeometry) -> None:
        for rim in self._edges(ground):
            self._stretch(rim, kit.wall(paths.length(rim), material="metal_panel", height_m=2.0, thick_m=0.1), 2.0)

    def _edges(self, ground: BaseGeometry) -> list[Array]:
        edges = []
        for piece in polygons(ground.buffer(-0.4), min_area_m2=20):
            rim = np.asarray(piece.simplify(0.3).exterior.coords)[:, :2]
            edges += [rim[i : i + 2] for i in range(len(rim) - 1) if np.linalg.norm(rim[i + 1] - rim[i]) > 2.0]
        return edges

    def _fence(self, line: Array, style: str, height_m: float) -> None:
        span = paths.length(line)
        if span >= 1.0:
            self._stretch(line, kit.fence(span, style=style, height_m=height_m), height_m)

    def _tree(self, x: float, y: float, kind: int, *, z: float = KERB_M, room_m: float = 1.5) -> None:
        if self.props.is_free(x, y, room_m):
            simple = self.regions.carriageways.distance(Point(x, y)) > NEAR_ROAD_M
            self.furnisher.plant(x, y, z, kind=kind, always=True, simple=simple)

    def _put(
        self,
        kind: str,
        parts: list[Part],
        x: float,
        y: float,
        radius: float,
        high: float,
        *,
        yaw: float | None = None,
        z: float = KERB_M,
    ) -> None:
        turn = float(self.rng.uniform(0, 2 * np.pi)) if yaw is None else yaw
        if self.props.is_free(x, y, radius) and not self.furnisher.ground.views.buffer(-0.5).contains(Point(x, y)):
            self.props.put(kind, parts, x, y, z, turn, radius_m=radius, high_m=high)
