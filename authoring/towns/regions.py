"""The town's plan as polygons: carriageways, parking bays, blocks, sidewalks and what is left inside the blocks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.towns import paths
from authoring.towns.network import BAY_M, CORNER_RADIUS_M, CROSSING_M, Network

Array = npt.NDArray[np.float64]
OUTER_M = 420.0
KERB_M = 0.15
KERB_STONE_M = 0.18
BRIDGE_SIDEWALK_M = 3.2
BAYS_A_GROUP = 4
BAY_TAPER_M = 1.3
BAY_GAP_M = 3.2
CORNER_CLEAR_M = 9.0


@dataclass(frozen=True, slots=True, eq=False)
class BayGroup:
    """Parking bays between two sidewalk bulbs: the pocket's outline and each bay's (x, y, yaw_deg)."""

    street: str
    side: int
    outline: Polygon
    bays: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Regions:
    """Polygons of a town in the plane; the modules that use them choose the heights."""

    network: Network
    canal: Polygon

    @cached_property
    def carriageways(self) -> BaseGeometry:
        """Where one drives, junctions with rounded corners included, parking bays not."""
        strips = []
        for street in self.network.streets.values():
            half = street.profile.half_width_m
            strips.append(self.band(street.name, -half, half))
        return unary_union(strips).buffer(CORNER_RADIUS_M, quad_segs=8).buffer(-CORNER_RADIUS_M, quad_segs=8)

    @cached_property
    def bay_groups(self) -> tuple[BayGroup, ...]:
        """All parking bays along streets."""
        groups: list[BayGroup] = []
        for street in self.network.streets.values():
            for side, wanted in ((1, street.bays_left), (-1, street.bays_right)):
                if wanted:
                    groups.extend(self._bays(street.name, side))
        return tuple(groups)

    @cached_property
    def corridors(self) -> BaseGeometry:
        """The ground that bridges and their ramps take, sidewalks included: nothing flat is there."""
        strips = []
        for street in self.network.streets.values():
            if street.hump_m:
                half = street.profile.half_width_m + BRIDGE_SIDEWALK_M
                strips.append(self.band(street.name, -half, half, self.network.ramp(street.name)))
        return unary_union(strips)

    @cached_property
    def level_roads(self) -> BaseGeometry:
        """All asphalt at height 0: carriageways and bays."""
        pockets = [group.outline for group in self.bay_groups]
        return unary_union([self.carriageways, *pockets]).difference(self.corridors)

    @cached_property
    def blocks(self) -> tuple[Polygon, ...]:
        """Everything between the streets, raised by a kerb; the canal and the bridges are cut out."""
        outer = box(-OUTER_M, -OUTER_M, OUTER_M, OUTER_M)
        pockets = [group.outline for group in self.bay_groups]
        land = outer.difference(unary_union([self.carriageways, *pockets, self.corridors, self.canal]))
        return tuple(sorted(polygons(land, min_area_m2=20.0), key=lambda p: (p.representative_point().x, p.area)))

    @cached_property
    def sidewalks(self) -> BaseGeometry:
        """The walked strip of every block along its streets, kerb stones included."""
        strips = []
        for street in self.network.streets.values():
            half = street.profile.half_width_m + street.profile.sidewalk_m
            left = half + (BAY_M[1] if street.bays_left else 0)
            right = half + (BAY_M[1] if street.bays_right else 0)
            strips.append(self.band(street.name, -right, left))
        land = unary_union(self.blocks)
        return unary_union(strips).intersection(land)

    @cached_property
    def kerb_stones(self) -> BaseGeometry:
        """The stones on the edge of the blocks towards the asphalt."""
        return unary_union(self.blocks).intersection(self.level_roads.buffer(KERB_STONE_M, quad_segs=4))

    @cached_property
    def interiors(self) -> tuple[Polygon, ...]:
        """What the sidewalks leave of each block."""
        land = unary_union(self.blocks).difference(self.sidewalks)
        return tuple(sorted(polygons(land, min_area_m2=60.0), key=lambda p: (p.representative_point().x, p.area)))

    @cached_property
    def medians(self) -> dict[str, Polygon]:
        """The raised strip in the middle of each wide street, by street; on bridges it is part of the bridge."""
        result = {}
        for street in self.network.streets.values():
            if street.profile.median_m and not street.hump_m:
                start_m, end_m = self.network.span(street.name)
                line = paths.cut(self.network.lines[street.name], start_m + 1.0, end_m - (1.0 if street.end else 0))
                half = street.profile.median_m / 2 - 0.45
                result[street.name] = LineString(line).buffer(half, quad_segs=8)
        return result

    def band(self, street: str, low_m: float, high_m: float, span: tuple[float, float] | None = None) -> Polygon:
        """The strip between two offsets (left positive) of a street's line, or of a stretch of it."""
        line = self.network.lines[street]
        if span is not None:
            line = paths.cut(line, *span)
        return Polygon(np.concatenate([paths.offset(line, low_m), paths.offset(line, high_m)[::-1]]))

    def _bays(self, name: str, side: int) -> Iterator[BayGroup]:
        street = self.network.streets[name]
        start_m, end_m = self.network.span(name)
        first, last = start_m + CORNER_CLEAR_M, end_m - CORNER_CLEAR_M
        group_m = BAYS_A_GROUP * BAY_M[0]
        count = int((last - first + BAY_GAP_M) // (group_m + 2 * BAY_TAPER_M + BAY_GAP_M))
        slack = (last - first - count * (group_m + 2 * BAY_TAPER_M) - (count - 1) * BAY_GAP_M) / 2
        kerb, back = street.profile.half_width_m - 0.02, street.profile.half_width_m + BAY_M[1]
        line, crossings = self.network.lines[name], self.network.crossings_m(name)
        for index in range(count):
            begin = first + slack + index * (group_m + 2 * BAY_TAPER_M + BAY_GAP_M)
            ending = begin + group_m + 2 * BAY_TAPER_M
            if any(begin - CROSSING_M / 2 < middle < ending + CROSSING_M / 2 for middle in crossings):
                continue
            outer = paths.cut(line, begin, ending)
            inner = paths.cut(line, begin + BAY_TAPER_M, begin + BAY_TAPER_M + group_m)
            outline = Polygon(
                np.concatenate([paths.offset(outer, side * kerb), paths.offset(inner, side * back)[::-1]])
            ).buffer(0)
            bays = []
            for bay in range(BAYS_A_GROUP):
                point, along = paths.at(line, begin + BAY_TAPER_M + (bay + 0.5) * BAY_M[0])
                centre = point + side * (kerb + back) / 2 * np.array([-along[1], along[0]])
                travel = -along if side > 0 and not street.profile.one_way else along
                bays.append((float(centre[0]), float(centre[1]), float(np.degrees(np.arctan2(travel[1], travel[0])))))
            yield BayGroup(name, side, outline, tuple(bays))


def polygons(shape: BaseGeometry, *, min_area_m2: float = 0.01) -> Iterator[Polygon]:
    """The polygons of any shape, lines and crumbs dropped."""
    if isinstance(shape, Polygon):
        if shape.area > min_area_m2:
            yield shape
    elif hasattr(shape, "geoms"):
        for part in shape.geoms:
            yield from polygons(part, min_area_m2=min_area_m2)


def canal_polygon(line: Iterable[tuple[float, float]], half_width_m: float) -> Polygon:
    """A canal's water surface."""
    return LineString(list(line)).buffer(half_width_m, cap_style="flat", join_style="mitre")
