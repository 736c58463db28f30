"""Plots along the suburb's streets: where houses, drives and gardens go."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely  # type: ignore[import-untyped]
from shapely.geometry import Polygon  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring.towns import paths, suburb
from authoring.towns.network import BAY_M, Street
from authoring.towns.regions import Regions

Array = npt.NDArray[np.float64]
UNIT_M = 5.5
GARAGE_M = 3.3
DRIVE_M = 2.9


@dataclass(frozen=True, slots=True, eq=False)
class Plot:
    """One plot: x runs along the street, y away from it, the origin in the middle of its front edge.

    Attributes:
        kind: `detached`, `pair`, `terrace`.
        origin: (2,) in the world; yaw_rad turns the plot's frame into it.
        width_m, depth_m: of the plot.
        house_m: (width, depth) of the house's main body.
        house_x_m, setback_m: where its middle and its front are.
        floors, units: storeys; houses in a row.
        garage: `left`, `right` or none.
        drives: middles of the drives along x.
        seed: decides everything that is drawn on the plot.
    """

    kind: str
    origin: Array
    yaw_rad: float
    width_m: float
    depth_m: float
    house_m: tuple[float, float]
    house_x_m: float
    setback_m: float
    floors: int
    seed: int
    units: int = 1
    garage: str = ""
    drives: tuple[float, ...] = field(default=())

    def world(self, points: npt.ArrayLike) -> Array:
        """Points (N, 2) of the plot's frame in the world."""
        cos, sin = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        turned: Array = np.asarray(points, np.float64) @ np.array([[cos, sin], [-sin, cos]]) + self.origin
        return turned

    def rectangle(self, x0: float, y0: float, x1: float, y1: float) -> Polygon:
        """A rectangle of the plot's frame, in the world."""
        return Polygon(self.world([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]))

    @property
    def house(self) -> Polygon:
        """What the house covers, its garage included."""
        half, (low, high) = self.house_m[0] / 2, (self.setback_m, self.setback_m + self.house_m[1])
        left = self.house_x_m - half - (GARAGE_M if self.garage == "left" else 0)
        right = self.house_x_m + half + (GARAGE_M if self.garage == "right" else 0)
        return self.rectangle(left, low, right, high)

    def drive(self, x_m: float) -> Polygon:
        """A drive from the footway to the house or beside it."""
        deep = self.setback_m + (1.0 if self.garage else 4.5)
        return self.rectangle(x_m - DRIVE_M / 2, -0.05, x_m + DRIVE_M / 2, deep)

    def crossover(self, x_m: float) -> Polygon:
        """Where a drive crosses verge and footway."""
        return self.rectangle(x_m - DRIVE_M / 2 - 0.3, -3.42, x_m + DRIVE_M / 2 + 0.3, 0.1)

    @property
    def path(self) -> Polygon:
        """The way from the footway to the front door, for a house without a drive; empty with one."""
        return Polygon() if self.drives else self.rectangle(-0.6, -0.05, 0.6, self.setback_m)


def plan_plots(regions: Regions, keep_off: BaseGeometry, *, rng: np.random.Generator) -> list[Plot]:
    """Plots along both sides of every street, as many as fit; none on what is kept free."""
    free = shapely.union_all(list(regions.interiors)).difference(keep_off)
    shapely.prepare(free)
    taken: list[Polygon] = []
    plots: list[Plot] = []
    streets = sorted(regions.network.streets.values(), key=lambda street: street.end is None)
    for street in streets:
        if street.profile.one_way:
            continue
        for side in (1, -1):
            plots.extend(_along(regions, street, side, free, taken, rng=rng))
    return plots


def _along(
    regions: Regions, street: Street, side: int, free: BaseGeometry, taken: list[Polygon], *, rng: np.random.Generator
) -> Iterator[Plot]:
    bays = street.bays_left if side > 0 else street.bays_right
    away = street.profile.half_width_m + street.profile.sidewalk_m + (BAY_M[1] if bays else 0.0) + 0.02
    line = paths.offset(regions.network.lines[street.name], side * away)
    line = line if side > 0 else line[::-1]
    total, station = paths.length(line), 2.0
    if street.end is None:
        total = min(total, 130.0) if side > 0 else total
        station = station if side > 0 else max(2.0, total - 130.0)
    terraced = (street.name, side) in suburb.TERRACES
    while station < total - 9.0:
        for wish in _wishes(terraced, rng):
            plot = _fit(line, station, total, wish, free, taken)
            if plot is not None:
                taken.append(plot.rectangle(-plot.width_m / 2, 0.0, plot.width_m / 2, plot.depth_m))
                yield plot
                station += plot.width_m + 0.3
                break
        else:
            station += 1.5


def _wishes(terraced: bool, rng: np.random.Generator) -> list[dict[str, object]]:
    """Kinds of houses for a plot in order of preference."""
    garage = str(rng.choice(["left", "right"]))
    body, deep = float(rng.uniform(8.6, 11.4)), float(rng.uniform(8.0, 9.2))
    setback, floors = float(rng.uniform(6.0, 7.6)), int(rng.choice([1, 2, 2, 2, 2, 3]))
    if floors == 1:
        body += 1.5
    sign = -1 if garage == "left" else 1
    seed = int(rng.integers(1 << 30))

    def detached(body_m: float, depth_m: float, floor_count: int) -> dict[str, object]:
        width = body_m + GARAGE_M + 2.4
        x = -sign * GARAGE_M / 2
        return {
            "kind": "detached", "width_m": width, "depth_m": depth_m, "house_m": (body_m, deep), "house_x_m": x,
            "setback_m": setback, "floors": floor_count, "garage": garage, "seed": seed,
            "drives": (x + sign * (body_m + GARAGE_M) / 2,),
        }  # fmt: skip

    def row(units: int, kind: str, setback_m: float) -> dict[str, object]:
        house = units * (UNIT_M if kind == "terrace" else 6.6)
        drives = () if kind == "terrace" else (-house / 2 - DRIVE_M / 2 - 0.3, house / 2 + DRIVE_M / 2 + 0.3)
        width = house + (0.6 if kind == "terrace" else 2 * DRIVE_M + 1.6)
        return {
            "kind": kind, "width_m": width, "depth_m": setback_m + deep + (7.0 if kind == "terrace" else 8.5),
            "house_m": (house, deep), "house_x_m": 0.0, "setback_m": setback_m, "units": units, "drives": drives,
            "floors": 3 if kind == "terrace" and rng.random() < 0.25 else 2, "seed": seed,
        }  # fmt: skip

    if terraced:
        count = int(rng.integers(4, 7))
        return [row(units, "terrace", 3.2) for units in range(count, 2, -1)] + [detached(8.2, 17.0, 2)]
    small = {**detached(8.2, 16.5, 2), "garage": "", "width_m": 10.6, "house_x_m": 0.0, "drives": (), "setback_m": 4.5}
    wishes = [detached(body, setback + deep + 9.0, floors), detached(8.4, setback + deep + 3.5, 2), small]
    return [row(2, "pair", 6.2), *wishes] if rng.random() < 0.28 else wishes


def _fit(
    line: Array, station: float, total: float, wish: dict[str, object], free: BaseGeometry, taken: list[Polygon]
) -> Plot | None:
    width = float(wish["width_m"])  # type: ignore[arg-type]
    if station + width > total:
        return None
    a, b = paths.at(line, station)[0], paths.at(line, station + width)[0]
    chord = float(np.linalg.norm(b - a))
    if chord < 0.97 * width:
        return None
    along = (b - a) / chord
    inward = np.array([-along[1], along[0]])
    bulge = max(float(((paths.cut(line, station, station + width) - a) @ inward).max()), 0.0)
    origin = np.round((a + b) / 2 + inward * bulge, 3)
    plot = Plot(origin=origin, yaw_rad=round(float(np.arctan2(along[1], along[0])), 5), **wish)  # type: ignore[arg-type]
    shape = plot.rectangle(-width / 2, 0.0, width / 2, plot.depth_m)
    if not free.contains(shape.buffer(-0.15)):
        return None
    core = shape.buffer(-0.1)
    return None if any(core.intersects(other) for other in taken) else plot
