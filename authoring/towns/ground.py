"""The level ground: asphalt, kerbs, sidewalks, medians, tactile paving, the canal and its quays."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from shapely.geometry import LineString, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import paths, solids
from authoring.towns.network import CROSSING_M, STOP_LINE_GAP_M
from authoring.towns.regions import KERB_M, Regions

WATER_M = -1.7
COPING_M = 0.6
TACTILE_DEPTH_M = 0.8
BACKING_M = 0.014
"""How far the second layer of the ground lies below the one that is seen; yards, which are lower, lie above it."""

BACKING_RIM_M = 0.5
"""How far the second layer reaches below what borders it."""

BACKING_CELL_M = 87.0
"""Side of its pieces: not that of the layer above, so that no two joints lie one below the other."""

WALL_FOOT_M = 0.4
"""How far the paving of a sidewalk reaches towards buildings beside it, so that no strip of yard of a few centimetres
is seen between the sidewalk and a wall.
"""

YARD_M = KERB_M - 0.01
"""Yards lie a finger lower than what borders them: where a site reaches over one, the site is what is seen."""


def lay_ground(sink: Sink, regions: Regions, sites: BaseGeometry, footprints: BaseGeometry) -> None:
    """Builds all level ground except the sites, which `authoring.towns.sites` builds.

    Args:
        sink: takes the faces.
        regions: the plan.
        sites: ground of the sites.
        footprints: ground on which buildings stand.
    """
    worn = unary_union(
        [
            regions.band(s.name, -s.profile.half_width_m, s.profile.half_width_m)
            for s in regions.network.streets.values()
            if s.bays_left and s.bays_right
        ]
    )
    roads = regions.level_roads
    solids.flat(sink, roads.difference(worn), 0.0, "asphalt", "road")
    solids.flat(sink, roads.intersection(worn), 0.0, "asphalt_worn", "road")
    tactile = tactile_paving(regions)
    stones = regions.kerb_stones
    quay = regions.canal.buffer(COPING_M, join_style="mitre").difference(regions.canal)
    taken = unary_union([sites, quay])
    before_walls = _before_walls(regions, footprints).difference(taken)
    paved = unary_union([regions.sidewalks, before_walls]).difference(stones).difference(tactile)
    solids.flat(sink, paved, KERB_M, "pavement", "sidewalk")
    solids.flat(sink, stones, KERB_M, "kerb", "sidewalk")
    solids.flat(sink, tactile.difference(stones), KERB_M, "tactile", "sidewalk")
    for land in regions.blocks:
        for rim in solids.boundary_towards(land, regions.level_roads):
            solids.wall(sink, rim, 0.0, KERB_M, "kerb", "sidewalk")
    lay_backing(sink, regions, unary_union(regions.blocks))
    for interior in regions.interiors:
        yard = interior.difference(taken).difference(before_walls)
        solids.flat(sink, yard, YARD_M, "cobbles" if interior.area < 12000 else "concrete", "ground")
    for median in regions.medians.values():
        _median(sink, median)
    _canal(sink, regions)


def _before_walls(regions: Regions, footprints: BaseGeometry) -> BaseGeometry:
    """The ground inside the blocks that lies both beside a building and beside a sidewalk, and below their walls."""
    near_walls = footprints.buffer(WALL_FOOT_M, join_style="mitre")
    near_sidewalks = regions.sidewalks.buffer(2 * WALL_FOOT_M, join_style="mitre")
    return near_walls.intersection(near_sidewalks).intersection(unary_union(list(regions.interiors)))


def lay_backing(sink: Sink, regions: Regions, land: BaseGeometry, paved: BaseGeometry | None = None) -> None:
    """Lay a second layer below sidewalks and roads.

    Stones, paving and asphalt meet in T-junctions, where a rasteriser leaves a pixel open here and there: through it
    the sidewalk or the road of this layer is seen, and not what lies far below the town.

    Args:
        sink: takes the faces.
        regions: the plan.
        land: the level land beside the roads, at the height of the kerbs.
        paved: asphalt at height 0 beside the plan's roads.
    """
    walked = unary_union([regions.sidewalks, regions.kerb_stones])
    walked = walked.buffer(BACKING_RIM_M, join_style="mitre").intersection(land)
    solids.flat(sink, walked, KERB_M - BACKING_M, "pavement", "sidewalk", cell_m=BACKING_CELL_M)
    roads = regions.level_roads
    beside = land if paved is None else unary_union([land, paved])
    rim = roads.buffer(BACKING_RIM_M, join_style="mitre").intersection(beside)
    solids.flat(sink, unary_union([roads, rim]), -BACKING_M, "asphalt", "road", cell_m=BACKING_CELL_M)


def tactile_paving(regions: Regions) -> BaseGeometry:
    """The studded paving on the sidewalk at both ends of every crossing."""
    network, strips = regions.network, []
    for street in network.streets.values():
        line = network.lines[street.name]
        half = street.profile.half_width_m
        edges = (half, -half - TACTILE_DEPTH_M - 0.35)
        for middle in network.crossings_m(street.name):
            span = (middle - CROSSING_M / 2, middle + CROSSING_M / 2)
            strips += [regions.band(street.name, left, left + TACTILE_DEPTH_M + 0.35, span) for left in edges]
        for at_start in (True, False) if street.end else (True,):
            mouth = network.mouths[street.name, at_start] - STOP_LINE_GAP_M
            low, high = sorted(s if at_start else paths.length(line) - s for s in (mouth, mouth - CROSSING_M))
            for left in edges:
                strips.append(regions.band(street.name, left, left + TACTILE_DEPTH_M + 0.35, (low, high)))
    return unary_union(strips).intersection(regions.sidewalks)


def _median(sink: Sink, median: Polygon) -> None:
    rim = np.asarray(median.exterior.coords)[:, :2]
    if median.exterior.is_ccw:
        rim = rim[::-1]
    solids.wall(sink, rim[::-1], 0.0, KERB_M, "kerb", "sidewalk")
    inner = median.buffer(-0.3)
    solids.flat(sink, median.difference(inner), KERB_M, "kerb", "sidewalk")
    solids.flat(sink, inner, KERB_M, "grass", "terrain")


def _canal(sink: Sink, regions: Regions) -> None:
    canal = regions.canal
    solids.flat(sink, canal, WATER_M, "water", "ground", cell_m=220.0)
    coping = canal.buffer(COPING_M, join_style="mitre").difference(canal).difference(regions.corridors)
    solids.flat(sink, coping, KERB_M, "concrete", "ground")
    rim = np.asarray(canal.exterior.coords)[:, :2]
    if canal.exterior.is_ccw:
        rim = rim[::-1]
    for start, end in pairwise(rim):
        if abs(end[0] - start[0]) > 20:
            edge = paths.densified(np.array([start, end]), 60.0)
            solids.wall(sink, edge, WATER_M - 0.5, KERB_M, "ashlar", "wall")
    clear = regions.corridors
    rail = canal.buffer(COPING_M * 0.6, join_style="mitre").exterior.difference(clear.buffer(0.05))
    for piece in getattr(rail, "geoms", [rail]):
        points = np.asarray(piece.coords)[:, :2]
        if abs(points[:, 0]).min() < 240 and np.ptp(points[:, 0]) > 5:
            near = LineString(points).intersection(box(-240, -240, 240, 240))
            for part in getattr(near, "geoms", [near]):
                if part.length > 2:
                    solids.railing(sink, np.asarray(part.coords)[:, :2], KERB_M, "anthracite", "fence")
