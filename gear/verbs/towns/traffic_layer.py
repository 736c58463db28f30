"""The traffic layer of a town map: lanes, sidewalks, crosswalks and parking bays."""

from __future__ import annotations

import numpy as np

from gear.values.geometry import Array
from gear.verbs.towns.canvas import Canvas, Colour
from gear.world.roads.lanes import Lane, LaneGraph, ParkingBay, Walk
from gear.world.roads.polyline import Polyline

LANE: Colour = (52, 84, 140)
JUNCTION: Colour = (214, 128, 38)
WALK: Colour = (150, 112, 74)
STRIPE: Colour = (255, 255, 255)
BAY: Colour = (92, 102, 126)

LANE_PX, JUNCTION_PX, WALK_PX, BAY_PX = 1.1, 0.8, 0.9, 0.8
ARROW_EVERY_M = 22.0
LONGEST_ARROW_PX = 22.0
STRIPE_M = 0.5
STRIPE_EVERY_M = 1.1


def draw_traffic(canvas: Canvas, graph: LaneGraph) -> None:
    """Draws the lanes, sidewalks, crosswalks and parking bays of a town.

    Args:
        canvas: the town map.
        graph: lanes, sidewalks, crosswalks and parking bays of the town.
    """
    for bay in graph.bays:
        _bay(canvas, bay)
    for walk in graph.walks.values():
        if walk.is_crossing:
            _zebra(canvas, walk)
        else:
            canvas.dashes(canvas.to_px(walk.line.points_m), WALK, WALK_PX, dash_px=2.0, gap_px=3.0)
    for lane in sorted(graph.lanes.values(), key=lambda lane: not lane.is_junction):
        _lane(canvas, lane)


def lane_arrow(canvas: Canvas, tip_px: Array, heading_rad: float, length_px: float, colour: Colour) -> None:
    """Draws an arrowhead that shows the direction of a lane.

    Args:
        canvas: the map.
        tip_px: position of the middle of the arrowhead.
        heading_rad: direction, counter-clockwise from east.
        length_px: length of the arrowhead.
        colour: colour of the arrowhead.
    """
    along = np.array([np.cos(heading_rad), -np.sin(heading_rad)]) * length_px
    across = np.array([-along[1], along[0]]) * 0.42
    back = tip_px - along * 0.5
    canvas.fill(np.stack([tip_px + along * 0.5, back + across, back + along * 0.25, back - across]), colour)


def _lane(canvas: Canvas, lane: Lane) -> None:
    colour, width_px = (JUNCTION, JUNCTION_PX) if lane.is_junction else (LANE, LANE_PX)
    canvas.line(canvas.to_px(lane.line.points_m), colour, width_px)
    arrows = 1 if lane.is_junction else max(1, round(lane.line.length_m / ARROW_EVERY_M))
    arrow_px = min(0.9 * lane.width_m * canvas.px_per_m, LONGEST_ARROW_PX) * (0.7 if lane.is_junction else 1.0)
    for number in range(arrows):
        point, heading_rad = lane.line.at((number + 0.5) / arrows * lane.line.length_m)
        lane_arrow(canvas, canvas.to_px(point)[0], heading_rad, arrow_px, colour)


def _zebra(canvas: Canvas, walk: Walk) -> None:
    stripes = max(2, round(walk.line.length_m / STRIPE_EVERY_M))
    for number in range(stripes):
        middle_m = (number + 0.5) / stripes * walk.line.length_m
        canvas.fill(canvas.to_px(_strip(walk.line, middle_m, STRIPE_M / 2, walk.width_m / 2)), STRIPE)


def _strip(line: Polyline, middle_m: float, half_length_m: float, half_width_m: float) -> Array:
    ends = [line.at(middle_m + along, side) for along, side in (
        (-half_length_m, half_width_m), (half_length_m, half_width_m), (half_length_m, -half_width_m),
        (-half_length_m, -half_width_m),
    )]  # fmt: skip
    return np.array([point[:2] for point, _ in ends])


def _bay(canvas: Canvas, bay: ParkingBay) -> None:
    along = np.array([np.cos(bay.yaw_rad), np.sin(bay.yaw_rad)]) * bay.length_m / 2
    across = np.array([-np.sin(bay.yaw_rad), np.cos(bay.yaw_rad)]) * bay.width_m / 2
    middle = np.array(bay.position_m[:2])
    corners = [middle + along + across, middle + along - across, middle - along - across, middle - along + across]
    canvas.line(canvas.to_px(corners), BAY, BAY_PX, closed=True)
    nose = [middle + along * 0.75, middle + along * 0.3 + across * 0.5, middle + along * 0.3 - across * 0.5]
    canvas.fill(canvas.to_px(nose), BAY)
