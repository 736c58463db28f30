"""Puts the suburb together and writes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from shapely.geometry import LineString, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import solids, suburb
from authoring.towns.collision import town_solids
from authoring.towns.document import bay_rows
from authoring.towns.lanes import Lane, lane_graph
from authoring.towns.network import BAY_M
from authoring.towns.props import Ground, Props
from authoring.towns.regions import KERB_M, BayGroup, Regions
from authoring.towns.suburb_furniture import SuburbFurnisher
from authoring.towns.suburb_gardens import CAR_M, Gardener, shops
from authoring.towns.suburb_park import board_solids, build_island, build_park, park_ground
from authoring.towns.suburb_plots import plan_plots
from authoring.towns.suburb_skyline import build_skyline
from authoring.towns.suburb_streets import lay_streets, paint, tactile
from authoring.towns.walks import crosswalks, sidewalks
from authoring.towns.wear import wear_streets
from authoring.towns.writing import write_document, write_meshes

CELL_M = 165.0
SEED = 20


def suburb_regions() -> Regions:
    """The plan of the suburb as polygons; it has no canal."""
    return Regions(suburb.NETWORK, Polygon())


def suburb_lanes() -> dict[str, Lane]:
    """The lanes of the suburb by name."""
    return lane_graph(suburb.NETWORK)


def write_suburb(folder: Path) -> None:
    """Write suburb.xml and its meshes into a folder, replacing what is there.

    Args:
        folder: where the file goes; meshes go to `suburb/` in it.
    """
    regions = suburb_regions()
    views = unary_union([_fan(board, eye) for board, eye in zip(suburb.BOARDS, suburb.EYES, strict=True)])
    park = park_ground(regions, suburb.PARK)
    far = box(-430, -430, 430, 430).difference(box(-280, -280, 280, 280))
    keep_off = unary_union([park, views, Polygon(suburb.SHOPS), far, box(-18, -18, 18, 18)])
    plots = plan_plots(regions, keep_off, rng=np.random.default_rng([SEED, 1]))
    crossovers = unary_union([plot.crossover(x) for plot in plots for x in plot.drives])

    sink = Sink("static")
    props = Props(sink)
    walkable = Ground(regions.sidewalks.buffer(-0.25), unary_union([tactile(regions), crossovers.buffer(0.3)]), views)
    furnisher = SuburbFurnisher(props, regions, walkable, rng=np.random.default_rng([SEED, 3]))
    for node in regions.network.nodes:
        furnisher.node(node)
    for name, side, share in suburb.BUS_STOPS:
        furnisher.bus_stop(regions.network.streets[name], side, share)
    for street in regions.network.streets.values():
        furnisher.street(street)
    gardener = Gardener(props, regions, furnisher, views)
    for plot in plots:
        gardener.build(plot)
    build_park(props, furnisher, park, views, np.random.default_rng([SEED, 4]))
    build_island(props, furnisher, regions, views, np.random.default_rng([SEED, 5]))
    forecourt = shops(props, suburb.SHOPS, np.random.default_rng([SEED, 6])).difference(regions.sidewalks)
    paved = unary_union([*gardener.paved, park, forecourt])
    lay_streets(sink, regions, crossovers, paved)
    solids.flat(sink, forecourt, KERB_M, "cobbles", "sidewalk")
    wear_streets(sink, regions, seed=SEED)
    paint(sink, regions)
    occupied = unary_union(
        [
            regions.carriageways.buffer(6.0),
            park,
            views,
            box(-150, -150, 155, 150),
            *[plot.rectangle(-plot.width_m / 2, 0, plot.width_m / 2, plot.depth_m) for plot in plots],
        ]
    )
    build_skyline(sink, occupied, np.random.default_rng([SEED, 7]))
    props.solids.extend(board_solids(suburb.BOARDS))

    document = write_meshes(folder, "suburb", suburb.BOUNDS, sink, props, cell_m=CELL_M)
    document.solids.extend([*town_solids(regions, ()), *props.solids])
    document.lanes.extend(suburb_lanes().values())
    document.sidewalks.extend(sidewalks(regions, suburb.BOUNDS))
    document.crosswalks.extend(walk for walk in crosswalks(regions) if "_out_" not in walk.name)
    document.bays.extend([*bay_rows(_usable(regions)), ("drives", *CAR_M, np.asarray(gardener.drive_bays))])
    write_document(folder, document)


def _usable(regions: Regions) -> Iterator[BayGroup]:
    """The bays that lie on asphalt with all corners: not where the kerb of a bend cuts into them."""
    roads = regions.level_roads.buffer(0.02)
    for group in regions.bay_groups:
        kept = []
        for x, y, yaw_deg in group.bays:
            along = np.array([np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))]) * BAY_M[0] / 2
            across = np.array([-along[1], along[0]]) * BAY_M[1] / BAY_M[0]
            corners = [np.array([x, y]) + a * along + b * across for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
            if roads.contains(Polygon(corners)):
                kept.append((x, y, yaw_deg))
        yield replace(group, bays=tuple(kept))


def _fan(board: tuple[float, float, float], eye: tuple[float, float]) -> BaseGeometry:
    """From a viewpoint to both ends of a board and a little beyond, and the ground that the board takes."""
    at, start = np.array(board[:2]), np.array(eye, np.float64)
    facing = np.array([np.cos(np.radians(board[2])), np.sin(np.radians(board[2]))])
    across = np.array([-facing[1], facing[0]]) * 5.5
    toward = (at - start) / np.linalg.norm(at - start)
    fan = Polygon([start, at + across, at - facing * 2.5 + across, at - facing * 2.5 - across, at - across])
    return fan.convex_hull.union(LineString([start, at + toward]).buffer(3.0))
