"""Where people walk and cars park, as lines and lists for the town's `<custom>`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import linemerge  # type: ignore[import-untyped]

from authoring.towns import paths
from authoring.towns.network import CROSSING_M, STOP_LINE_GAP_M
from authoring.towns.regions import BRIDGE_SIDEWALK_M, KERB_M, Regions

Array = npt.NDArray[np.float64]
FROM_KERB_M = 2.4
WIDTH_M = 2.0
MAX_POINTS = 160


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """The middle (N, 3) of a strip people walk on, and its width."""

    name: str
    width_m: float
    points: Array


def sidewalks(regions: Regions, bounds: tuple[float, float, float, float]) -> Iterator[Walk]:
    """The walked middle of every sidewalk inside the bounds; on bridges it follows the slope."""
    inside = box(*bounds).buffer(-2.0)
    room = regions.sidewalks.buffer(-WIDTH_M / 2 - 0.1).intersection(inside)
    for index, land in enumerate(regions.blocks):
        ring = land.buffer(-FROM_KERB_M, join_style="mitre").boundary
        for part, line in enumerate(_lines(ring.intersection(room))):
            if line.length > 4.0:
                points = np.asarray(line.simplify(0.02).coords)[:, :2]
                for piece, first in enumerate(range(0, len(points) - 1, MAX_POINTS - 1)):
                    plan = points[first : first + MAX_POINTS]
                    yield Walk(
                        f"block{index}_{part}_{piece}", WIDTH_M, np.column_stack([plan, np.full(len(plan), KERB_M)])
                    )
    for street in regions.network.streets.values():
        if street.hump_m:
            start, end = regions.network.ramp(street.name)
            line = paths.densified(paths.cut(regions.network.lines[street.name], start, end), 2.0)
            z = regions.network.height_m(street.name, paths.stations(line) + start) + KERB_M
            for side, sign in (("left", 1.0), ("right", -1.0)):
                left_m = sign * (street.profile.half_width_m + BRIDGE_SIDEWALK_M - 1.35)
                yield Walk(f"{street.name}_{side}", 1.6, np.column_stack([paths.offset(line, left_m), z]))


def crosswalks(regions: Regions) -> Iterator[Walk]:
    """Every zebra crossing from kerb to kerb, except on streets out of the town, which have no traffic."""
    network = regions.network
    for street in network.streets.values():
        if not street.end:
            continue
        line = network.lines[street.name]
        half = street.profile.half_width_m - 0.3
        for index, middle in enumerate(network.crossings_m(street.name)):
            yield _across(line, middle, half, f"{street.name}_{index}")
        for at_start in (True, False):
            node = network.nodes[street.start if at_start else street.end]
            if node.control == "yield" and len(network.arms(node.name)) <= 3:
                continue
            back = network.mouths[street.name, at_start] - STOP_LINE_GAP_M - CROSSING_M / 2
            middle = back if at_start else paths.length(line) - back
            yield _across(line, middle, half, f"{node.name}_{street.name}")


def _across(line: Array, station_m: float, half_m: float, name: str) -> Walk:
    """A crossing of a street at a distance along its line."""
    point, along = paths.at(line, station_m)
    normal = np.array([-along[1], along[0]])
    ends = np.stack([point + normal * half_m, point - normal * half_m])
    return Walk(name, CROSSING_M, np.column_stack([ends, np.zeros(2)]))


def _lines(shape: BaseGeometry) -> list[LineString]:
    if shape.geom_type == "MultiLineString":
        shape = linemerge(shape)
    return [part for part in getattr(shape, "geoms", [shape]) if part.geom_type == "LineString"]
