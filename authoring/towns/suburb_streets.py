"""The suburb's level ground and the paint on its streets: grass verges, crossovers, give-way lines."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import paths, solids, suburb
from authoring.towns.ground import lay_backing, tactile_paving
from authoring.towns.markings import WHITE, Painter, paint_crossings, zebra
from authoring.towns.network import CROSSING_M, STOP_LINE_GAP_M, Network, Street
from authoring.towns.regions import KERB_M, Regions

VERGE_M = (0.18, 1.38)
# An arm has right of way at a T junction if another arm lies within this angle of straight ahead.
STRAIGHT_RAD = np.radians(42)


def gives_way(network: Network, node: str, arm: str) -> bool:
    """Whether an arm of a junction has a give-way line and sign: every arm except the through road of a T junction."""
    arms = network.arms(node)
    if len(arms) > 3 or network.nodes[node].control == "signals":
        return True
    ways = {name: away for name, _, away in arms}
    others = [away for name, away in ways.items() if name != arm]
    return not any(float(-ways[arm] @ other) > np.cos(STRAIGHT_RAD) for other in others)


def tactile(regions: Regions) -> BaseGeometry:
    """Studded paving at the crossings, none around the circus."""
    return tactile_paving(regions).difference(Point(0, 0).buffer(33.0))


def verges(regions: Regions, crossovers: BaseGeometry) -> BaseGeometry:
    """The strips of grass between kerb and footway."""
    strips = []
    for street in regions.network.streets.values():
        if street.profile.one_way:
            continue
        start, end = regions.network.span(street.name)
        half = street.profile.half_width_m
        for low, high in ((half + VERGE_M[0], half + VERGE_M[1]), (-half - VERGE_M[1], -half - VERGE_M[0])):
            strips.append(regions.band(street.name, low, high, (start + 1.5, end - 1.5 if street.end else end - 0.1)))
    bays = unary_union([group.outline for group in regions.bay_groups])
    keep_off = unary_union([bays.buffer(2.4), crossovers, tactile(regions).buffer(0.3), Point(0, 0).buffer(33.0)])
    return unary_union(strips).intersection(regions.sidewalks).difference(keep_off)


def lay_streets(sink: Sink, regions: Regions, crossovers: BaseGeometry, paved: BaseGeometry) -> None:
    """Lay roads, kerbs, footways, verges and lawns.

    Args:
        sink: takes the faces.
        regions: the plan.
        crossovers: where drives cross verge and footway.
        paved: ground of gardens and sites that other modules build.
    """
    area = box(-suburb.FLAT_M, -suburb.FLAT_M, suburb.FLAT_M, suburb.FLAT_M)
    worn = unary_union([regions.band(s, -9, 9) for s in ("oak", "west", "ring_w1")])
    roads = regions.level_roads
    solids.flat(sink, roads.difference(worn), 0.0, "asphalt", "road")
    solids.flat(sink, roads.intersection(worn), 0.0, "asphalt_worn", "road")
    studs, stones, grass = tactile(regions), regions.kerb_stones, verges(regions, crossovers)
    walk = regions.sidewalks.intersection(area).difference(unary_union([stones, studs, grass]))
    crossing = crossovers.intersection(walk)
    solids.flat(sink, walk.difference(crossing), KERB_M, "pavement", "sidewalk")
    solids.flat(sink, crossing, KERB_M, "asphalt", "sidewalk")
    solids.flat(sink, grass, KERB_M, "grass", "terrain")
    solids.flat(sink, stones, KERB_M, "kerb", "sidewalk")
    solids.flat(sink, studs.difference(stones), KERB_M, "tactile", "sidewalk")
    for land in regions.blocks:
        for rim in solids.boundary_towards(land, roads):
            solids.wall(sink, rim, 0.0, KERB_M, "kerb", "sidewalk")
    lay_backing(sink, regions, unary_union(regions.blocks).intersection(area))
    lawns = unary_union(list(regions.interiors)).intersection(area).difference(paved)
    solids.flat(sink, lawns, KERB_M, "grass", "terrain")


def paint(sink: Sink, regions: Regions) -> None:
    """White centre lines, lines to give way or stop at, zebra crossings, parking bays."""
    network = regions.network
    for street in network.streets.values():
        painter = Painter(sink, network, street)
        start, end = network.span(street.name)
        if not street.profile.one_way:
            painter.dashes(start + 0.5, end - 0.5, 0.0, dash_m=2.0, gap_m=4.0, paint=WHITE)
        for at_start in (True, False) if street.end else ():
            _mouth(painter, network, street, at_start)
        paint_crossings(painter)
        for side, bays in ((1, street.bays_left), (-1, street.bays_right)):
            if bays:
                painter.dashes(start, end, side * (street.profile.half_width_m - 0.1), dash_m=1, gap_m=1, paint=WHITE)


def _mouth(painter: Painter, network: Network, street: Street, at_start: bool) -> None:
    profile = street.profile
    node = network.nodes[street.start if at_start else str(street.end)]
    mouth, line_m = network.mouths[street.name, at_start], paths.length(painter.line)

    def span(low_m: float, high_m: float) -> tuple[float, float]:
        ends = (low_m, high_m) if at_start else (line_m - high_m, line_m - low_m)
        return min(ends), max(ends)

    if node.control != "yield" or len(network.arms(node.name)) > 3:
        zebra(painter, sum(span(mouth - STOP_LINE_GAP_M - CROSSING_M, mouth - STOP_LINE_GAP_M)) / 2)
    if not gives_way(network, node.name, street.name) or street.profile.one_way:
        return
    for index in range(profile.backward if at_start else profile.forward):
        left = profile.lane_offset_m(index, forward=not at_start)
        low, high = span(mouth, mouth + 0.35)
        if node.control == "yield":
            for tooth in np.arange(-profile.lane_m / 2 + 0.3, profile.lane_m / 2 - 0.2, 0.6):
                painter.stripe(low, high, left + float(tooth), 0.35)
        else:
            painter.stripe(low, high, left, profile.lane_m - 0.3)
