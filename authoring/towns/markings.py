"""Paint on the road: centre and lane lines, stop lines, zebra crossings, arrows, parking bays."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from authoring.kit.parts import Sink
from authoring.towns import paths, solids
from authoring.towns.network import BAY_M, CROSSING_M, STOP_LINE_GAP_M, Network, Street
from authoring.towns.regions import Regions

Array = npt.NDArray[np.float64]
LIFT_M = 0.006
WHITE, YELLOW = "road_paint_white", "road_paint_yellow"
LABEL = "road_marking"
SOLID_NEAR_JUNCTION_M = 22.0
ARROW_M = 14.0
STEM = ((0.0, -0.08), (0.0, 0.08), (2.6, 0.08), (2.6, -0.08))


class Painter:
    """Paints a street in its own coordinates: distance along its line and offset to the left."""

    def __init__(self, sink: Sink, network: Network, street: Street) -> None:
        self.sink, self.network, self.street = sink, network, street
        self.line = network.lines[street.name]

    def stripe(self, start_m: float, end_m: float, left_m: float, width_m: float, paint: str = WHITE) -> None:
        """A stripe along the street."""
        piece = paths.cut(self.line, start_m, end_m)
        if self.street.hump_m:
            piece = paths.densified(piece, 2.0)
        z = self.network.height_m(self.street.name, paths.stations(piece) + start_m)[:, None] + LIFT_M
        left = np.hstack([paths.offset(piece, left_m + width_m / 2), z])
        right = np.hstack([paths.offset(piece, left_m - width_m / 2), z])
        solids.ribbon(self.sink, left, right, paint, LABEL)

    def dashes(self, start_m: float, end_m: float, left_m: float, *, dash_m: float, gap_m: float, paint: str) -> None:
        """A broken line that fits whole dashes between its ends."""
        count = max(1, int((end_m - start_m + gap_m) // (dash_m + gap_m)))
        slack = (end_m - start_m - count * dash_m - (count - 1) * gap_m) / 2
        for index in range(count):
            begin = start_m + max(slack, 0) + index * (dash_m + gap_m)
            self.stripe(begin, min(begin + dash_m, end_m), left_m, 0.12, paint)

    def outline(self, station_m: float, left_m: float, corners: npt.ArrayLike, *, forward: bool) -> None:
        """A convex patch given in the frame of a lane: metres ahead and to the left of a point on it."""
        point, along = paths.at(self.line, station_m)
        normal = np.array([-along[1], along[0]])
        sign = 1 if forward else -1
        shape = np.asarray(corners, np.float64)
        plane = point + normal * left_m + sign * (shape[:, :1] * along + shape[:, 1:] * normal)
        z = self.network.height_m(self.street.name, station_m + sign * shape[:, 0]) + LIFT_M
        points = np.column_stack([plane, z])
        x, y = points[1] - points[0], points[2] - points[1]
        if x[0] * y[1] - x[1] * y[0] < 0:
            points = points[::-1]
        self.sink.polygon(WHITE, points, points[:, :2] / 2.0, label=LABEL)


def paint_streets(sink: Sink, regions: Regions, turns: Callable[[str], set[str]]) -> None:
    """Paint every street; `turns` says for a lane which of "left", "straight" and "right" it leads to."""
    network = regions.network
    for street in network.streets.values():
        painter = Painter(sink, network, street)
        _lines(painter)
        for at_start in (True, False) if street.end else (True,):
            _mouth(painter, at_start)
            if street.end is not None:
                _arrows(painter, at_start, turns)
        paint_crossings(painter)
    for group in regions.bay_groups:
        for x, y, yaw_deg in group.bays:
            _bay(sink, x, y, np.radians(yaw_deg), *BAY_M, z_m=LIFT_M)


def zebra(painter: Painter, middle_m: float) -> None:
    """The stripes of a crossing from kerb to kerb."""
    reach = painter.street.profile.half_width_m - 0.5
    count = int((2 * reach + 0.55) // 1.1)
    for left in (np.arange(count) - (count - 1) / 2) * 1.1:
        painter.stripe(middle_m - CROSSING_M / 2, middle_m + CROSSING_M / 2, float(left), 0.55)


def paint_crossings(painter: Painter) -> None:
    """Stripes and stop lines of a street's crossings between its junctions."""
    profile = painter.street.profile
    for middle in painter.network.crossings_m(painter.street.name):
        zebra(painter, middle)
        for forward, count in ((True, profile.forward), (False, profile.backward)):
            back = CROSSING_M / 2 + STOP_LINE_GAP_M
            low, high = sorted(middle + (-s if forward else s) for s in (back, back + 0.45))
            for index in range(count):
                left = profile.lane_offset_m(index, forward=forward)
                painter.stripe(low, high, left, profile.lane_m - 0.3)


def paint_bay(sink: Sink, x: float, y: float, yaw_rad: float, length_m: float, width_m: float, z_m: float) -> None:
    """The lines either side of one bay of a parking lot."""
    _bay(sink, x, y, yaw_rad, length_m, width_m, z_m=z_m, across=False)


def _lines(painter: Painter) -> None:
    street, profile = painter.street, painter.street.profile
    start, end = painter.network.span(street.name)
    solid = min(SOLID_NEAR_JUNCTION_M, (end - start) / 3)
    if not profile.one_way:
        offsets = (-0.15, 0.15)
        if profile.median_m:
            edge = profile.median_m / 2 - 0.18
            for left in (-edge, edge):
                painter.stripe(start, end, left, 0.12, YELLOW)
        elif street.hump_m:
            for left in offsets:
                painter.stripe(start, end, left, 0.12, YELLOW)
        else:
            for low, high in ((start, start + solid), (end - solid, end)):
                for left in offsets:
                    painter.stripe(low, high, left, 0.12, YELLOW)
            painter.dashes(start + solid, end - solid, 0.0, dash_m=3, gap_m=4.5, paint=YELLOW)
    for forward, count in ((True, profile.forward), (False, profile.backward)):
        for index in range(count - 1):
            middle = profile.lane_offset_m(index, forward=forward)
            left = middle + (-profile.lane_m / 2 if forward else profile.lane_m / 2)
            painter.dashes(start + solid, end - solid, left, dash_m=3, gap_m=6, paint=WHITE)
            painter.stripe(start, start + solid, left, 0.12)
            painter.stripe(end - solid, end, left, 0.12)
    kerb = profile.half_width_m - 0.35
    for side, bays in ((1, street.bays_left), (-1, street.bays_right)):
        if bays:
            painter.dashes(start, end, side * kerb, dash_m=1, gap_m=1, paint=WHITE)
        elif profile.median_m or profile.one_way or street.hump_m:
            painter.stripe(start, end, side * kerb, 0.12, YELLOW if profile.one_way and side > 0 else WHITE)


def _mouth(painter: Painter, at_start: bool) -> None:
    street, profile = painter.street, painter.street.profile
    node = painter.network.nodes[street.start if at_start else street.end or ""]
    mouth = painter.network.mouths[street.name, at_start]
    line_m = paths.length(painter.line)

    def place(back_m: float) -> float:
        return back_m if at_start else line_m - back_m

    if node.control != "yield" or len(painter.network.arms(node.name)) > 3:
        middle = place(mouth - STOP_LINE_GAP_M - CROSSING_M / 2)
        zebra(painter, middle)
    coming = profile.backward if at_start else profile.forward
    for index in range(coming):
        left = profile.lane_offset_m(index, forward=not at_start)
        low, high = sorted((place(mouth), place(mouth + 0.45)))
        painter.stripe(low, high, left, profile.lane_m - 0.3)


def _arrows(painter: Painter, at_start: bool, turns: Callable[[str], set[str]]) -> None:
    street, profile = painter.street, painter.street.profile
    count = profile.backward if at_start else profile.forward
    if count < 2 and not profile.one_way:
        return
    mouth = painter.network.mouths[street.name, at_start]
    line_m = paths.length(painter.line)
    for index in range(count):
        lane = f"{street.name}_{'b' if at_start else 'f'}{index}"
        left = profile.lane_offset_m(index, forward=not at_start)
        for back in (mouth + 3.5, mouth + 3.5 + ARROW_M):
            station = back + 3.6 if at_start else line_m - back - 3.6
            _arrow(painter, station, left, turns(lane), forward=not at_start)


def _arrow(painter: Painter, station_m: float, left_m: float, turns: set[str], *, forward: bool) -> None:
    painter.outline(station_m, left_m, STEM, forward=forward)
    if "straight" in turns:
        painter.outline(station_m, left_m, ((2.6, -0.35), (3.6, 0.0), (2.6, 0.35)), forward=forward)
    for name, side in (("left", 1.0), ("right", -1.0)):
        if name in turns:
            foot = 1.3 if "straight" in turns else 2.0
            arm = (
                (foot, side * 0.08),
                (foot + 0.45, side * 0.65),
                (foot + 0.65, side * 0.55),
                (foot + 0.3, side * 0.08),
            )
            head = ((foot + 0.0, side * 0.85), (foot + 1.05, side * 1.0), (foot + 0.95, side * 0.3))
            painter.outline(station_m, left_m, arm, forward=forward)
            painter.outline(station_m, left_m, head, forward=forward)


def _bay(
    sink: Sink, x: float, y: float, yaw_rad: float, length_m: float, width_m: float, *, z_m: float, across: bool = True
) -> None:
    ends = [((length_m / 2, 0), (0.05, width_m / 2)), ((-length_m / 2, 0), (0.05, width_m / 2))]
    sides = [((0, width_m / 2), (length_m / 2, 0.05)), ((0, -width_m / 2), (length_m / 2, 0.05))]
    turn = np.array([[np.cos(yaw_rad), np.sin(yaw_rad)], [-np.sin(yaw_rad), np.cos(yaw_rad)]])
    for centre, half in ends if across else sides:
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half + centre
        plane = corners @ turn + (x, y)
        sink.polygon(WHITE, np.column_stack([plane, np.full(4, z_m)]), plane / 2.0, label=LABEL)
