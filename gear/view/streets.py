"""The streets of a town for the map of the page: centre lines of lanes, sidewalks and crosswalks, seen from above."""

from __future__ import annotations

from gear.values.errors import GearError
from gear.values.serial import Json
from gear.world.assets.library import AssetLibrary
from gear.world.roads.polyline import Polyline
from gear.world.roads.read_lanes import read_lanes


def streets(town: str) -> Json:
    """Returns the streets of a town of gear.

    Args:
        town: name of the town.

    Returns:
        A list of `[kind, width in metres, [east, north, east, north, ...] in metres]`, where kind is `lane`,
        `sidewalk` or `crosswalk`; empty if gear has no such town.
    """
    try:
        graph = read_lanes(AssetLibrary.for_town(town).town)
    except GearError:  # the town of another package or of the user's own file
        return []
    walks = [("crosswalk" if one.is_crossing else "sidewalk", one.width_m, one.line) for one in graph.walks.values()]
    lanes = [("lane", one.width_m, one.line) for one in graph.lanes.values()]
    return [[kind, round(width_m, 2), _from_above(line)] for kind, width_m, line in (*walks, *lanes)]


def _from_above(line: Polyline) -> list[float]:
    return [round(float(value), 1) for point in line.points_m for value in point[:2]]
