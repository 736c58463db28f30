"""Builds what is on the plots: houses, drives, hedges, fences, garden trees, bins."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit import gardens, houses
from authoring.kit.parts import Part, place
from authoring.towns import solids, suburb
from authoring.towns.collision import Solid, level_box
from authoring.towns.furniture import Furnisher
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, Regions, polygons
from authoring.towns.suburb_plots import DRIVE_M, Plot

CAR_M = (5.0, 2.3)
# Hedges are planted in the longest pieces that fit; what overlaps is not seen.
HEDGES_M = (2.6, 5.0, 10.0)
DRIVES = ("cobbles", "asphalt_worn", "concrete", "roof_gravel", "cobbles")
BINS = ("plastic_green", "plastic_grey", "signal_blue", "brown_paint")
MAIL = ("signal_red", "black_paint", "dark_green", "white_paint", "galvanised")


class Gardener:
    """Builds plots; every plot is drawn from its own seed."""

    def __init__(self, props: Props, regions: Regions, furnisher: Furnisher, views: BaseGeometry) -> None:
        self.props, self.regions, self.furnisher, self.views = props, regions, furnisher, views
        self.within = box(*suburb.BOUNDS).buffer(-CAR_M[0])
        rng = np.random.default_rng([33, 1])
        self.hedges = {
            (long, tall): kit.hedge(long, high, 0.6, rng) for tall, high in enumerate((0.9, 1.35)) for long in HEDGES_M
        }
        self.shrubs = [
            kit.shrub(high, rng, foliage=foliage)
            for high, foliage in ((1.0, "foliage_green"), (1.4, "foliage_dark"), (0.8, "foliage_light"))
        ]
        self.drive_bays: list[tuple[float, float, float, float]] = []
        self.paved: list[Polygon] = []
        self.lots: list[Plot] = []

    def build(self, plot: Plot) -> None:
        """Build one plot."""
        rng = np.random.default_rng([34, plot.seed])
        self._house(plot, rng)
        self._pave(plot, rng)
        self._front(plot, rng)
        self._back(plot, rng)

    def _house(self, plot: Plot, rng: np.random.Generator) -> None:
        width, depth = plot.house_m
        if plot.kind == "detached":
            roofs = ["gable", "gable", "hip", "cross"] if plot.floors > 1 else ["gable", "hip"]
            parts = houses.detached(width, depth, plot.floors, rng, roof=str(rng.choice(roofs)), garage=plot.garage)
        else:
            parts = houses.row(plot.units, width / plot.units, depth, plot.floors, rng)
        self._put(plot, parts, plot.house_x_m, plot.setback_m + depth / 2, 0.0)
        body = level_box(f"house_{len(self.lots)}", plot.house, KERB_M)
        x, y, _ = body.centre
        high = houses.BASE_M + houses.FLOOR_M * plot.floors
        size = (body.size[0], body.size[1], high / 2)
        self.props.solids.append(Solid(body.name, "box", (x, y, KERB_M + high / 2), size, body.quaternion))
        self.lots.append(plot)

    def _pave(self, plot: Plot, rng: np.random.Generator) -> None:
        material = str(rng.choice(DRIVES))
        for index, x in enumerate(plot.drives):
            shape = plot.drive(x).difference(unary_union([self.regions.sidewalks, plot.house]))
            self.paved.append(shape)
            solids.flat(self.props.sink, shape, KERB_M, material, "parking")
            name = f"ground.drive_{len(self.lots)}_{index}"
            self.props.solids.append(level_box(name, plot.drive(x), KERB_M))
            cx, cy = plot.world([(x, plot.setback_m - CAR_M[0] / 2 - 0.35)])[0]
            if rng.random() < 0.6 and self.within.contains(Point(cx, cy)):
                yaw = round(float(np.degrees(plot.yaw_rad)) + 90.0, 2)
                self.drive_bays.append((float(cx), float(cy), KERB_M, yaw))
        if not plot.path.is_empty:
            count = plot.units
            for index in range(count):
                middle = plot.house_x_m + (index + 0.5 - count / 2) * plot.house_m[0] / count
                middle += plot.house_m[0] / count * (0.28 if index % 2 == 0 else -0.28) if count > 1 else 0.0
                strip = plot.rectangle(middle - 0.6, -0.05, middle + 0.6, plot.setback_m)
                shape = strip.difference(self.regions.sidewalks)
                self.paved.append(shape)
                solids.flat(self.props.sink, shape, KERB_M, "pavement", "ground")

    def _front(self, plot: Plot, rng: np.random.Generator) -> None:
        """The boundary to the footway, and what stands behind it."""
        style = str(rng.choice(["hedge", "hedge", "hedge", "wall", "wall", "wall", "picket", "open", "bars"]))
        if plot.kind == "terrace":
            style = str(rng.choice(["wall", "bars", "hedge"]))
        half = plot.width_m / 2 - 0.2
        gaps = sorted((x - DRIVE_M / 2 - 0.15, x + DRIVE_M / 2 + 0.15) for x in plot.drives)
        if not plot.path.is_empty:
            count = plot.units
            turn = [0.28 if index % 2 == 0 else -0.28 for index in range(count)] if count > 1 else [0.0]
            unit = plot.house_m[0] / count
            middles = [plot.house_x_m + (index + 0.5 - count / 2 + turn[index]) * unit for index in range(count)]
            gaps = [(m - 0.6, m + 0.6) for m in middles]
        start = -half
        tall = 1 if rng.random() < 0.35 else 0
        brick = str(rng.choice(["brick_red", "brick_buff", "brick_red"]))
        for low, high in [*gaps, (half, half)]:
            self._boundary(plot, style, start, low, tall, brick)
            start = high
        for index in range(int(rng.integers(0, 3)) if plot.kind != "terrace" else 0):
            x, y = float(rng.uniform(-half + 1, half - 1)), float(rng.uniform(1.0, max(1.2, plot.setback_m - 2.0)))
            self._plant(plot, x, y, tree=index == 0 and plot.setback_m > 6.0 and rng.random() < 0.5, far=False, rng=rng)
        if plot.drives:
            side = plot.drives[0] - np.sign(plot.drives[0]) * (DRIVE_M / 2 + 0.5)
            self._put(plot, gardens.mail_box(str(rng.choice(MAIL))), float(side), 0.25, 0.0)
            for index in range(int(rng.integers(0, 3))):
                x, y = float(side), 2.0 + 0.75 * index
                self._put(plot, gardens.wheelie_bin(str(rng.choice(BINS))), x, y, float(rng.uniform(-0.2, 0.2)))

    def _boundary(self, plot: Plot, style: str, low: float, high: float, tall: int, brick: str) -> None:
        span, middle = high - low, (low + high) / 2
        if span < 0.8 or style == "open":
            return
        if style == "hedge":
            fitting = [long for long in HEDGES_M if long <= span + 0.2]
            if fitting:
                long = fitting[-1]
                count = max(1, round(span / long))
                for index in range(count):
                    x = low + long / 2 + (span - long) * (index / (count - 1) if count > 1 else 0.5)
                    kind = f"hedge{tall}_{long:g}".replace(".", "_")
                    self._instance(plot, kind, self.hedges[long, tall], x, 0.45, 0.0, 0.9)
        elif style == "wall":
            wall = kit.wall(span, material=brick, height_m=0.65, thick_m=0.22)
            self._put(plot, wall, middle, 0.25, 0.0)
        elif style == "picket":
            self._put(plot, gardens.picket_fence(span), middle, 0.25, 0.0)
        else:
            self._put(plot, kit.wall(span, material=brick, height_m=0.35, thick_m=0.22), middle, 0.25, 0.0)
            ends = plot.world([(low, 0.25), (high, 0.25)])
            solids.railing(self.props.sink, ends, KERB_M + 0.35, "black_paint", "fence", top_m=0.6, post_m=2.6)
        centre = plot.world([(middle, 0.25)])[0]
        turn = (float(np.cos(plot.yaw_rad / 2)), 0.0, 0.0, float(np.sin(plot.yaw_rad / 2)))
        name = f"boundary_{len(self.lots)}_{low:.1f}"
        place_m = (float(centre[0]), float(centre[1]), KERB_M + 0.4)
        self.props.solids.append(Solid(name, "box", place_m, (span / 2, 0.2, 0.4), turn))

    def _back(self, plot: Plot, rng: np.random.Generator) -> None:
        """Fences around the back garden, trees over the roofs, a shed."""
        half, front = plot.width_m / 2 - 0.05, plot.setback_m + 1.5
        span = plot.depth_m - front
        self._put(plot, gardens.panel_fence(span), -half, front + span / 2, np.pi / 2)
        self._put(plot, gardens.panel_fence(2 * half), 0.0, plot.depth_m - 0.1, 0.0)
        low = plot.setback_m + plot.house_m[1] + 2.0
        if plot.depth_m - low > 2:
            x, y = float(rng.uniform(-half + 1.5, half - 1.5)), float(rng.uniform(low, plot.depth_m - 1.2))
            self._plant(plot, x, y, tree=rng.random() < 0.3, far=True, rng=rng)
        if plot.kind == "detached" and rng.random() < 0.3 and plot.depth_m - low > 5:
            x = half - 1.6 if plot.garage == "left" else -half + 1.6
            self._put(plot, gardens.shed(rng), x, plot.depth_m - 1.6, 0.0)

    def _plant(self, plot: Plot, x: float, y: float, *, tree: bool, far: bool, rng: np.random.Generator) -> None:
        px, py = (float(v) for v in plot.world([(x, y)])[0])
        point = Point(px, py)
        if self.views.contains(point) or any(shape.distance(point) < 1.0 for shape in self.paved[-8:]):
            return
        if tree and self.props.is_free(px, py, 2.2) and plot.house.distance(point) > 1.6:
            self.furnisher.plant(px, py, KERB_M, kind=int(rng.integers(20)), always=True, simple=far)
        elif not far and rng.random() < 0.6 and self.props.is_free(px, py, 0.8) and plot.house.distance(point) > 0.7:
            kind = int(rng.integers(len(self.shrubs)))
            self._instance(plot, f"shrub{kind}", self.shrubs[kind], x, y, float(rng.uniform(0, 6)), 0.6)

    def _put(self, plot: Plot, parts: list[Part], x: float, y: float, yaw: float) -> None:
        px, py = plot.world([(x, y)])[0]
        turn = plot.yaw_rad + yaw
        self.props.sink.extend(place(parts, x_m=float(px), y_m=float(py), z_m=KERB_M, yaw_rad=turn))

    def _instance(self, plot: Plot, kind: str, parts: list[Part], x: float, y: float, yaw: float, high: float) -> None:
        px, py = (float(v) for v in plot.world([(x, y)])[0])
        self.props.instance(kind, parts, px, py, KERB_M, plot.yaw_rad + yaw, radius_m=0.3, high_m=high)


def shops(props: Props, corners: tuple[tuple[float, float], ...], rng: np.random.Generator) -> BaseGeometry:
    """A row of shops with flats above, facing north over a paved forecourt; returns what it takes."""
    site = Polygon(corners)
    x0, y0, x1, _ = site.bounds
    width, depth = x1 - x0 - 2.0, 10.5
    parts = kit.building(
        style="shop_row", width_m=width, depth_m=depth, floors=2, rng=rng, sides=("front", "left", "right")
    )
    x, y = (x0 + x1) / 2, y0 + depth / 2 + 0.5
    props.sink.extend(place(parts, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=np.pi))
    props.solids.append(Solid("shops", "box", (x, y, 3.5), (width / 2, depth / 2, 3.5)))
    for index, piece in enumerate(polygons(site)):
        props.solids.append(level_box(f"ground.forecourt_{index}", piece, KERB_M))
    for index, px in enumerate(np.arange(x0 + 4.0, x1 - 3.0, 5.5)):
        py = y + depth / 2 + 2.2
        if index % 3 == 0:
            props.put("cafe", kit.cafe(rng), float(px), py, KERB_M, 0.3 * index, radius_m=1.2, high_m=1.0)
        elif index % 3 == 1:
            props.put("planter", kit.planter("box", rng), float(px), py, KERB_M, 0.0, radius_m=0.8, high_m=0.8)
        else:
            props.put("bin", kit.bin_(style="post"), float(px), py, KERB_M, 0.0, radius_m=0.3, high_m=1.0)
    return site
