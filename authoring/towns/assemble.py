"""Puts a town together and writes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Polygon  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import town10
from authoring.towns.bridges import build_bridge
from authoring.towns.collision import town_solids
from authoring.towns.document import bay_rows
from authoring.towns.furniture import Furnisher
from authoring.towns.ground import lay_ground, tactile_paving
from authoring.towns.lanes import Lane, lane_graph, turns_of
from authoring.towns.lots import Lot, build_lots, plan_lots
from authoring.towns.markings import paint_streets
from authoring.towns.props import Ground, Props
from authoring.towns.regions import Regions, canal_polygon
from authoring.towns.sites import SiteBuilder
from authoring.towns.skyline import build_skyline
from authoring.towns.walks import crosswalks, sidewalks
from authoring.towns.wear import wear_streets
from authoring.towns.writing import write_document, write_meshes

CELL_M = 110.0
SEED = 10


def town10_regions() -> Regions:
    """The plan of town10 as polygons."""
    return Regions(town10.NETWORK, canal_polygon(town10.CANAL_LINE, town10.CANAL_HALF_WIDTH_M))


def town10_lanes() -> dict[str, Lane]:
    """The lanes of town10 by name."""
    return lane_graph(town10.NETWORK)


def write_town10(folder: Path) -> None:
    """Write town10.xml and its meshes into a folder, replacing what is there.

    Args:
        folder: where the file goes; meshes go to `town10/` in it.
    """
    regions, lanes = town10_regions(), town10_lanes()
    sites = _sites(regions)
    sink = Sink("static")
    lots = plan_lots(regions, sites, rng=np.random.default_rng([SEED, 1]))
    lay_ground(sink, regions, sites, unary_union([lot.footprint for lot in lots]))
    wear_streets(sink, regions, seed=SEED)
    paint_streets(sink, regions, lambda lane: turns_of(lanes, lane))
    for street in regions.network.streets.values():
        if street.hump_m:
            build_bridge(sink, regions.network, street)
    build_lots(sink, lots, seed=SEED)
    build_skyline(sink, regions, lots, rng=np.random.default_rng([SEED, 2]))

    props, lot_bays = _furnish(sink, regions, lots)

    document = write_meshes(folder, "town10", town10.BOUNDS, sink, props, cell_m=CELL_M)
    document.solids.extend([*town_solids(regions, lots), *props.solids])
    document.lanes.extend(lanes.values())
    document.sidewalks.extend(sidewalks(regions, town10.BOUNDS))
    document.crosswalks.extend(crosswalks(regions))
    document.bays.extend([*bay_rows(regions.bay_groups), *lot_bays])
    write_document(folder, document)


def _furnish(
    sink: Sink, regions: Regions, lots: list[Lot]
) -> tuple[Props, list[tuple[str, float, float, npt.NDArray[np.float64]]]]:
    props = Props(sink)
    views = unary_union([LineString([view[:2], view[2:]]).buffer(3.0).union(_fan(view)) for view in town10.VIEWS])
    ground = Ground(regions.sidewalks.buffer(-0.25), tactile_paving(regions), views)
    furnisher = Furnisher(props, regions, ground, rng=np.random.default_rng([SEED, 3]))
    for node in regions.network.nodes:
        furnisher.node(node)
    for name, side, share in town10.BUS_STOPS:
        furnisher.bus_stop(regions.network.streets[name], side, share)
    for street in regions.network.streets.values():
        furnisher.street(street)
    builder = SiteBuilder(props, regions, furnisher, town10.HILL, rng=np.random.default_rng([SEED, 4]))
    for site in town10.SITES:
        builder.build(site)
    taken = unary_union([*(lot.footprint.buffer(1.2) for lot in lots), regions.corridors.buffer(1.5), _sites(regions)])
    furnisher.quay(
        np.asarray(town10.CANAL_LINE), town10.CANAL_HALF_WIDTH_M + 3.0, unary_union(regions.interiors).difference(taken)
    )
    return props, builder.lot_bays


def _sites(regions: Regions) -> BaseGeometry:
    return unary_union([site.ground(regions) for site in town10.SITES])


def _fan(view: tuple[float, float, float, float]) -> Polygon:
    """From a viewpoint to both ends of a board and a little beyond."""
    board, eye = np.array(view[:2]), np.array(view[2:])
    toward = (board - eye) / np.linalg.norm(board - eye)
    across = np.array([-toward[1], toward[0]]) * 6.0
    return Polygon([eye, board + across, board + toward * 3 + across, board + toward * 3 - across, board - across])
