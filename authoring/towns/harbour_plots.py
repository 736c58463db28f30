"""The plots of harbour: what ground each has and what stands on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit import industry, industry_plant, industry_yard
from authoring.kit.parts import Part, place
from authoring.towns import paths, solids
from authoring.towns.collision import Solid, level_box
from authoring.towns.markings import paint_bay
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, Regions

Array = npt.NDArray[np.float64]
CAR_BAY_M = (5.0, 2.5)
LORRY_BAY_M = (16.0, 3.8)
BARRIER_M = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """A rectangle of ground.

    Attributes:
        corners: xmin, ymin, xmax, ymax.
        material, label: of its surface.
        fenced: which sides have netting, of `nesw`.
        walled: which sides have a row of concrete barriers.
    """

    name: str
    corners: tuple[float, float, float, float]
    material: str = "concrete"
    label: str = "ground"
    fenced: str = ""
    walled: str = ""

    @property
    def outline(self) -> Polygon:
        """The rectangle."""
        return box(*self.corners)


PLOTS = (
    Plot(name="lorry_park", corners=(-204, -129, -142, -72), material="asphalt_worn", label="parking", fenced="nw"),
    Plot(name="warehouse_1", corners=(-138, -129, -26, -34), material="asphalt_worn", fenced="nw"),
    Plot(name="depot", corners=(-204, -68, -142, -34), material="roof_gravel", fenced="n"),
    Plot(name="workshops", corners=(26, -129, 104, -34), material="asphalt_worn", fenced="ne"),
    Plot(name="plant", corners=(108, -129, 206, -34), material="roof_gravel", fenced="nesw"),
    Plot(name="terminal", corners=(11, -206, 206, -153), material="concrete", fenced="nesw"),
    Plot(name="warehouse_2", corners=(-124, -231, -24, -152), material="asphalt_worn"),
    Plot(name="tank_farm", corners=(-206, -206, -144, -153), material="roof_gravel", fenced="nesw"),
    Plot(name="office", corners=(-134, 34, -26, 129), material="asphalt_worn", label="parking"),
    Plot(name="logistics", corners=(-206, 34, -138, 129), material="asphalt_worn", fenced="sew"),
    Plot(name="petrol", corners=(28, 92, 104, 131), material="asphalt_worn"),
    Plot(name="units", corners=(112, 34, 206, 118), material="asphalt_worn", fenced="sw"),
    Plot(name="grid", corners=(144, 153, 206, 206), material="roof_gravel", fenced="nesw"),
    Plot(name="store", corners=(-206, 153, -14, 206), material="asphalt_worn", label="parking"),
    Plot(name="verge_south", corners=(50, -32, 78, -18.5), material="grass", label="terrain"),
    Plot(name="verge_north", corners=(-82, 18.5, -44, 32), material="grass", label="terrain"),
    Plot(
        name="verge_east",
        corners=(223.5, -155, 236, -125),
        material="roof_gravel",
        label="terrain",
        fenced="e",
        walled="e",
    ),
    Plot(
        name="verge_west",
        corners=(-238, 124, -223.5, 157),
        material="roof_gravel",
        label="terrain",
        fenced="w",
        walled="w",
    ),
    Plot(name="verge_petrol", corners=(106, 120, 150, 131.5), material="grass", label="terrain", walled="s"),
    Plot(
        name="verge_terminal",
        corners=(-22.5, -232, -8, -203),
        material="grass",
        label="terrain",
        fenced="w",
        walled="w",
    ),
    *(
        Plot(name=f"gate_{index}", corners=corners, material="asphalt_worn")
        for index, corners in enumerate(
            (
                (-179, -136, -165, -129),
                (-90, -131.6, -75, -129),
                (58, -136, 72, -129),
                (-81, -152, -67, -147),
                (-179, 129, -165, 136),
                (-87, 129, -73, 136),
                (34, 131, 48, 136),
                (86, 131, 100, 136),
                (162, 118, 176, 136),
                (-70, 147, -56, 153),
            )
        )
    ),
)


class Yards:
    """Builds every plot."""

    def __init__(self, props: Props, regions: Regions, *, rng: np.random.Generator) -> None:
        self.props, self.sink, self.rng = props, props.sink, rng
        self.bays: list[tuple[str, float, float, Array]] = []
        land = unary_union(list(regions.blocks))
        self.land = land.difference(regions.sidewalks.buffer(0.05))

    def ground(self) -> BaseGeometry:
        """What all plots cover."""
        return unary_union([plot.outline for plot in PLOTS]).intersection(self.land)

    def build(self) -> None:
        """Build the ground of all plots and the objects on them."""
        for plot in PLOTS:
            ground = plot.outline.intersection(self.land)
            solids.flat(self.sink, ground, KERB_M, plot.material, plot.label)
            self.props.solids.append(level_box(f"ground.{plot.name}", plot.outline, KERB_M))
            for side in plot.fenced:
                self._fence(plot, side)
            for side in plot.walled:
                self._barriers(plot, side)
        self._south()
        self._terminal()
        self._south_west()
        self._north()
        self._goods()

    def _south(self) -> None:
        self._house("warehouse_1", industry.warehouse(92, 40, 11.0, self.rng), (-82, -62), 0.0, (92, 40, 11.0))
        self._row("lorry_park", [(x, -117.5) for x in np.arange(-200, -146, 4.2)], 90.0, LORRY_BAY_M)
        self._row("lorry_park_north", [(x, -83.5) for x in np.arange(-200, -146, 4.2)], -90.0, LORRY_BAY_M)
        self._row("warehouse_1", [(x, -124.5) for x in np.arange(-132, -96, 2.7)], 90.0, CAR_BAY_M)
        self._row("warehouse_1_docks", [(x, -94.0) for x in np.arange(-114, -62, 6.0)], -90.0, LORRY_BAY_M)
        shed = industry.shed(34, 18, 6.0, self.rng, cladding="cladding_green")
        self._house("depot", shed, (-180, -47), np.pi, (34, 18, 7.0))
        self._stack("depot_boxes", 2, 1, (-152.5, -46), highest=3)
        for index, (x, cladding) in enumerate(((46.0, "cladding_blue"), (84.0, "cladding_white"))):
            parts = industry.shed(30, 24, 7.0, self.rng, cladding=cladding)
            self._house(f"workshop_{index}", parts, (x, -62), 0.0, (30, 24, 8.5))
        self._row("workshops", [(x, -123.0) for x in np.arange(30, 100, 2.7)], 90.0, CAR_BAY_M)
        self._row("workshops_north", [(x, -83.0) for x in np.arange(34, 62, 2.7)], -90.0, CAR_BAY_M)
        self._house("silos", industry_plant.silos(5), (150, -58), 0.0, (36, 7, 20.0))
        for index, (x, y, radius, high) in enumerate(((186, -104, 10, 12), (158, -108, 8, 9), (190, -62, 7, 14))):
            parts = industry_plant.tank(radius, high, swatch=("white_paint", "cream_paint", "aluminium")[index])
            self._house(f"tank_{index}", parts, (x, y), 0.0, (2 * radius, 2 * radius, high))
        self._house("boilers", industry.shed(22, 16, 10.0, self.rng), (124, -92), 0.0, (22, 16, 12.0))
        self._house("chimney", industry_plant.chimney(64.0), (124, -72), 0.0, (6.4, 6.4, 60.0))

    def _terminal(self) -> None:
        rows = (
            (36.0, -180.0, 6, 2),
            (72.0, -180.0, 6, 2),
            (112.0, -184.0, 8, 2),
            (150.0, -180.0, 6, 2),
            (187.0, -181.0, 8, 2),
        )
        for index, (x, y, deep, wide) in enumerate(rows):
            self._stack(f"terminal_{index}", deep, wide, (x, y), highest=4)
        for x in (18.0, 92.0, 131.0, 169.0):
            mast = kit.street_lamp(height_m=14.0, arm_m=2.2, style="double")
            self.props.put("mast", mast, x, -180.0, KERB_M, np.pi / 2, radius_m=0.3, high_m=12.0)

    def _south_west(self) -> None:
        parts = industry.warehouse(80, 34, 9.5, self.rng, cladding="cladding_blue")
        self._house("warehouse_2", parts, (-74, -204), np.pi, (80, 34, 9.5))
        self._row("warehouse_2", [(x, -156.5) for x in np.arange(-120, -60, 2.7)], -90.0, CAR_BAY_M)
        for index, (x, y) in enumerate(((-192, -166), (-171, -166), (-153, -164), (-190, -191), (-164, -191))):
            radius = (9.0, 9.0, 6.0, 10.0, 11.0)[index]
            tank = industry_plant.tank(radius, radius * 1.15)
            self._house(f"farm_{index}", tank, (x, y), 0.0, (2 * radius, 2 * radius, radius))

    def _north(self) -> None:
        office = kit.building(style="glass_office", width_m=38, depth_m=16, floors=6, rng=self.rng,
                              sides=("front", "right", "left", "back"))  # fmt: skip
        self._house("office", office, (-54, 110), np.pi, (38, 16, 23.0))
        wing = kit.building(style="concrete_office", width_m=16, depth_m=26, floors=3, rng=self.rng,
                            sides=("front", "right", "left", "back"))  # fmt: skip
        self._house("office_wing", wing, (-44, 76), np.pi, (16, 26, 11.0))
        for index, y in enumerate((60.0, 66.6, 88.0, 94.6)):
            bays = [(x, y) for x in np.arange(-128, -84, 2.7)]
            self._row(f"office_{index}", bays, 90.0 if index % 2 == 0 else -90.0, CAR_BAY_M)
        self._house(
            "logistics",
            industry.warehouse(56, 36, 10.0, self.rng, cladding="cladding_green"),
            (-173, 72),
            np.pi,
            (56, 36, 10.0),
        )
        self._row("logistics", [(x, 122.0) for x in np.arange(-202, -150, 4.4)], -90.0, (10.0, 3.4))
        canopy = place(industry.petrol_station(self.rng), x_m=68, y_m=119, z_m=KERB_M, yaw_rad=np.pi)
        self.sink.extend(canopy)
        for x in (60.5, 75.5):
            for y in (116.4, 121.6):
                self._solid(f"canopy_{x}_{y}", (x, y), 0.0, (0.4, 0.4, 4.7))
        self._solid("pumps", (68, 116.4), 0.0, (11, 1.1, 2.0))
        self._solid("pumps_north", (68, 121.6), 0.0, (11, 1.1, 2.0))
        self._house("kiosk", industry.kiosk(self.rng), (66, 102), np.pi, (16, 9, 4.0))
        self.props.put("price_mast", industry.price_mast(), 34.0, 128.0, KERB_M, np.pi / 2, radius_m=1.0, high_m=6.6)
        self._row("petrol", [(x, 97.0) for x in np.arange(80, 100, 2.7)], 90.0, CAR_BAY_M)
        for index, x in enumerate((130.0, 168.0)):
            parts = industry.shed(32, 22, 6.5, self.rng, cladding=("metal_panel", "cladding_white")[index])
            self._house(f"unit_{index}", parts, (x, 62), np.pi, (32, 22, 8.0))
        self._row("units", [(x, 112.0) for x in np.arange(116, 200, 2.7)], -90.0, CAR_BAY_M)
        self._house("switchgear", industry.shed(20, 10, 4.5, self.rng), (160, 172), np.pi, (20, 10, 6.0))
        for x in (180.0, 190.0, 200.0):
            self.sink.extend(place(industry_plant.pylon(14.0), x_m=x - 4, y_m=190.0, z_m=KERB_M, yaw_rad=np.pi / 2))
        self._stack("grid_boxes", 2, 1, (160, 192), highest=2)
        self._house("store", industry.warehouse(84, 26, 9.0, self.rng), (-64, 190), 0.0, (84, 26, 9.0))
        self._house(
            "store_2", industry.shed(46, 24, 7.5, self.rng, cladding="cladding_blue"), (-158, 190), 0.0, (46, 24, 9.0)
        )
        for index, (x0, x1) in enumerate(((-200, -120), (-112, -20))):
            self._row(f"store_{index}", [(x, 157.5) for x in np.arange(x0, x1, 2.7)], -90.0, CAR_BAY_M)

    def _goods(self) -> None:
        """Pallets, boxes and skips about the yards, along walls and fences."""
        spots = [(-134.0, y, np.pi / 2) for y in (-60.0, -72.0, -84.0)] + [
            (x, -36.5, 0.0) for x in (-120.0, -96.0, -70.0, -44.0)
        ]
        spots += [(64.5, y, np.pi / 2) for y in (-52.0, -64.0, -74.0)] + [
            (x, -38.0, 0.0) for x in (34.0, 52.0, 80.0, 98.0)
        ]
        spots += [(x, -226.0, 0.0) for x in (-110.0, -88.0, -60.0, -40.0)] + [
            (149.0, y, np.pi / 2) for y in (54.0, 66.0)
        ]
        spots += [(x, 38.0, 0.0) for x in (-200.0, -180.0, -158.0)] + [
            (x, 74.5, 0.0) for x in (122.0, 138.0, 160.0, 176.0)
        ]
        spots += [(-30.0, y, np.pi / 2) for y in (-90.0, -104.0)] + [(100.0, y, np.pi / 2) for y in (-96.0, -110.0)]
        for x, y, yaw in spots:
            if self.props.is_free(float(x), y, -2.0):
                goods = industry_yard.pallets(self.rng)
                self.props.put("goods", goods, float(x), y, KERB_M, yaw, radius_m=2.0, high_m=1.5)
        for index, (x, y) in enumerate(((-56, -121), (-34, -122), (34, -95), (190, 101), (-34, -168), (-38, 46))):
            self._stack(f"boxes_{index}", 1 + index % 2, 1, (float(x), float(y)), highest=2)

    def _house(
        self, name: str, parts: list[Part], middle: tuple[float, float], yaw: float, size: tuple[float, float, float]
    ) -> None:
        self.sink.extend(place(parts, x_m=middle[0], y_m=middle[1], z_m=KERB_M, yaw_rad=yaw))
        self._solid(name, middle, yaw, size)

    def _solid(self, name: str, middle: tuple[float, float], yaw: float, size: tuple[float, float, float]) -> None:
        turn = (round(float(np.cos(yaw / 2)), 6), 0.0, 0.0, round(float(np.sin(yaw / 2)), 6))
        half = (size[0] / 2, size[1] / 2, size[2] / 2)
        self.props.solids.append(Solid(f"house_{name}", "box", (*middle, KERB_M + half[2]), half, turn))
        self.props.spots.append((*middle, float(np.hypot(size[0], size[1])) / 2))

    def _stack(self, name: str, rows: int, columns: int, middle: tuple[float, float], *, highest: int) -> None:
        parts = industry_yard.container_stack(rows, columns, self.rng, highest=highest)
        size = (columns * 12.7, rows * 2.8, highest * 2.2)
        self._house(name, parts, middle, 0.0, size)

    def _row(
        self, name: str, middles: Sequence[tuple[float, float]], yaw_deg: float, bay_m: tuple[float, float]
    ) -> None:
        for x, y in middles:
            paint_bay(self.sink, float(x), y, np.radians(yaw_deg), *bay_m, z_m=KERB_M + 0.006)
        self.bays.append((name, *bay_m, np.array([(float(x), y, KERB_M, yaw_deg) for x, y in middles])))

    def _barriers(self, plot: Plot, side: str) -> None:
        """A row of concrete barriers along one side, in front of its netting."""
        line = _side(plot, side, 2.0)
        total = paths.length(line)
        for index in range(int(total / BARRIER_M)):
            piece = paths.cut(line, index * BARRIER_M + 0.05, (index + 1) * BARRIER_M - 0.05)
            x, y = (float(v) for v in piece.mean(0))
            yaw = float(np.arctan2(*(piece[1] - piece[0])[::-1]))
            parts = kit.jersey_barrier(BARRIER_M - 0.1)
            self.props.put("barrier", parts, x, y, KERB_M, yaw, radius_m=0.35, high_m=0.8)

    def _fence(self, plot: Plot, side: str) -> None:
        """Netting along one side, a metre inside."""
        line = _side(plot, side, 1.0)
        total = paths.length(line)
        count = max(1, round(total / 24.0))
        for index in range(count):
            piece = paths.cut(line, total * index / count, total * (index + 1) / count)
            x, y = (float(v) for v in piece.mean(0))
            yaw = float(np.arctan2(*(piece[1] - piece[0])[::-1]))
            long = total / count
            netting = industry_yard.chain_link(long)
            self.sink.extend(place(netting, x_m=x, y_m=y, z_m=KERB_M, yaw_rad=yaw))
            turn = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
            self.props.solids.append(
                Solid(f"netting_{x:.1f}_{y:.1f}", "box", (x, y, KERB_M + 1.1), (long / 2, 0.05, 1.1), turn)
            )


def _side(plot: Plot, side: str, inside_m: float) -> Array:
    """A line (2, 2) along one side of a plot, so far inside, with the plot on its right."""
    x0, y0, x1, y1 = plot.outline.buffer(-inside_m).bounds
    return np.array(
        {
            "n": ((x0, y1), (x1, y1)),
            "s": ((x1, y0), (x0, y0)),
            "w": ((x0, y0), (x0, y1)),
            "e": ((x1, y1), (x1, y0)),
        }[side]
    )
