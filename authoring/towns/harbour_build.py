"""Puts harbour together and writes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from shapely.geometry import LineString  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit.parts import Sink
from authoring.towns import harbour, solids
from authoring.towns.bridges import build_bridge
from authoring.towns.collision import town_solids
from authoring.towns.document import bay_rows
from authoring.towns.furniture import Furnisher
from authoring.towns.ground import lay_backing, tactile_paving
from authoring.towns.harbour_far import QUAY, WATER, build_surroundings, plant_fields
from authoring.towns.harbour_motorway import embankments, finish_bridge, lay_motorway, motorway_lanes, paved
from authoring.towns.harbour_plots import Yards
from authoring.towns.harbour_verges import furnish_motorway
from authoring.towns.lanes import Lane, lane_graph, turns_of
from authoring.towns.markings import paint_streets
from authoring.towns.props import Ground, Props
from authoring.towns.regions import KERB_M, Regions
from authoring.towns.walks import crosswalks, sidewalks
from authoring.towns.wear import wear_streets
from authoring.towns.writing import write_document, write_meshes

CELL_M = 110.0
SEED = 12
# How far out sidewalks are solid: beyond the bounds, for the roads that leave.
SOLID_M = 290.0
# Objects along the estate's sidewalks.
EXTRAS = ("bin", "bench", "cable_box") + ("none",) * 17


def harbour_regions() -> Regions:
    """The plan of harbour as polygons; motorway and embankments are cut out of the blocks as a canal would be."""
    return Regions(harbour.NETWORK, unary_union([paved(), embankments(harbour.NETWORK)]))


def harbour_lanes() -> dict[str, Lane]:
    """The lanes of harbour by name."""
    return motorway_lanes(lane_graph(harbour.NETWORK))


def write_harbour(folder: Path) -> None:
    """Write harbour.xml and its meshes into a folder, replacing what is there.

    Args:
        folder: where the file goes; meshes go to `harbour/` in it.
    """
    regions, lanes = harbour_regions(), harbour_lanes()
    sink = Sink("static")
    props = Props(sink)
    views = unary_union([LineString([view[:2], view[2:]]).buffer(6.0) for view in harbour.VIEWS])
    ground = Ground(regions.sidewalks.buffer(-0.25), tactile_paving(regions), views)
    yards = Yards(props, regions, rng=np.random.default_rng([SEED, 1]))
    _lay_ground(sink, regions, yards)
    lay_motorway(sink, regions.level_roads, rng=np.random.default_rng([SEED, 8]))
    wear_streets(sink, regions, seed=SEED)
    paint_streets(sink, regions, lambda lane: turns_of(lanes, lane))
    build_bridge(sink, regions.network, regions.network.streets["bridge"])
    finish_bridge(sink, regions.network)
    yards.build()
    furnisher = Furnisher(props, regions, ground, rng=np.random.default_rng([SEED, 3]), extras=EXTRAS)
    for node in regions.network.nodes:
        furnisher.node(node)
    for name, side, share in (("dock_e", 1, 0.4), ("estate_w", -1, 0.5)):
        furnisher.bus_stop(regions.network.streets[name], side, share)
    for street in regions.network.streets.values():
        furnisher.street(street)
    hedge = kit.hedge(14.0, 1.4, 1.3, np.random.default_rng([SEED, 7]))
    furnish_motorway(props, regions, furnisher, hedge, rng=np.random.default_rng([SEED, 4]))
    build_surroundings(sink, rng=np.random.default_rng([SEED, 5]))
    taken = unary_union(
        [yards.ground(), regions.carriageways, regions.sidewalks, regions.corridors, regions.canal, QUAY, WATER]
    )
    plant_fields(props, furnisher, taken, hedge, rng=np.random.default_rng([SEED, 6]))
    _write(folder, sink, props, regions, lanes, yards)


def _lay_ground(sink: Sink, regions: Regions, yards: Yards) -> None:
    """Roads, kerbs and sidewalks of the estate, grass wherever no plot is."""
    roads = regions.level_roads
    solids.flat(sink, roads, 0.0, "asphalt", "road")
    tactile, stones = tactile_paving(regions), regions.kerb_stones
    solids.flat(sink, regions.sidewalks.difference(stones).difference(tactile), KERB_M, "pavement", "sidewalk")
    solids.flat(sink, stones, KERB_M, "kerb", "sidewalk")
    solids.flat(sink, tactile.difference(stones), KERB_M, "tactile", "sidewalk")
    asphalt = unary_union([roads, paved()])
    for land in regions.blocks:
        for rim in solids.boundary_towards(land, asphalt):
            solids.wall(sink, rim, 0.0, KERB_M, "kerb", "sidewalk")
    lay_backing(sink, regions, unary_union(regions.blocks), paved())
    bare = unary_union([yards.ground(), regions.sidewalks, stones, QUAY, WATER])
    for land in regions.blocks:
        solids.flat(sink, land.difference(bare), KERB_M, "grass", "terrain")


def _write(folder: Path, sink: Sink, props: Props, regions: Regions, lanes: dict[str, Lane], yards: Yards) -> None:
    document = write_meshes(folder, "harbour", harbour.BOUNDS, sink, props, cell_m=CELL_M)
    document.solids.extend([*town_solids(regions, [], reach_m=SOLID_M), *props.solids])
    document.lanes.extend(lanes.values())
    document.sidewalks.extend(sidewalks(regions, harbour.BOUNDS))
    # No crosswalks there: slips have no sidewalks, and no cars drive on the roads that leave the town.
    dead = tuple(f"_{street.name}" for street in regions.network.streets.values() if street.end is None)
    document.crosswalks.extend(walk for walk in crosswalks(regions) if not walk.name.endswith(dead))
    document.bays.extend([*bay_rows(regions.bay_groups), *yards.bays])
    write_document(folder, document)
