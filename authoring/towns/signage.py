"""Signs along streets, arrows in bends, traffic lights at crossings, and railings at corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from authoring import kit
from authoring.kit.parts import Part
from authoring.towns import paths, solids
from authoring.towns.collision import Solid
from authoring.towns.network import CROSSING_M, STOP_LINE_GAP_M, Network, Street
from authoring.towns.regions import KERB_M

if TYPE_CHECKING:
    from authoring.towns.furniture import Furnisher

Array = npt.NDArray[np.float64]
FROM_KERB_M = 0.6
FIRST_M, PITCH_M = 22.0, 40.0
# If the place of a sign is taken, the sign stands this far before or behind it.
SHIFTS_M = (0.0, 2.4, -2.4, 4.8, -4.8)
FAST_MPS = 10.0
# Bends of at most this radius that turn at least so much have arrows on their outside.
BEND_M, BEND_RAD = 90.0, np.radians(50)
CHEVRON_M = 11.0
# Distance at which an arrow must be legible.
READ_FROM_M = 9.0
# No tree stands so far before a crossing's light.
CLEAR_M = 22.0
RAIL_M = (2.6, 8.4)
RAIL_HALF_M = 0.06
# An arm has no continuation ahead if no other arm lies within this angle of its direction.
HEAD_COS = np.cos(np.radians(50))


def signs_along(furnisher: Furnisher, street: Street, *, last_m: float, slow: bool = False) -> None:
    """Signs for speed limits and parking, in both directions.

    Args:
        furnisher: puts them down.
        street: which one.
        last_m: up to where along its line.
        slow: whether signs that warn of children replace every other sign.
    """
    start, _ = furnisher.network.span(street.name)
    limit = "speed_50" if street.profile.speed_mps > FAST_MPS else "speed_30"
    for forward, lanes in ((True, street.profile.forward), (False, street.profile.backward)):
        if not lanes:
            continue
        bays = street.bays_right if forward else street.bays_left
        parked = "parking" if bays else "no_parking"
        cycle = (limit, parked, "warning_children") if slow else (limit, parked, parked)
        for index, along_m in enumerate(np.arange(FIRST_M, last_m - start - 8.0, PITCH_M)):
            station = start + along_m if forward else last_m - along_m
            _sign(furnisher, street, cycle[index % 3], float(station), forward=forward)


def chevrons(furnisher: Furnisher, street: Street) -> None:
    """Arrows on the outside of tight bends, for traffic that turns right; the arrows point to the right."""
    line = furnisher.network.lines[street.name]
    for x, y, radius_m in street.corners:
        middle = float(paths.stations(line)[np.hypot(line[:, 0] - x, line[:, 1] - y).argmin()])
        before, after = (paths.at(line, middle + step * radius_m * 0.7)[1] for step in (-1, 1))
        turn = float(np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after))
        if radius_m > BEND_M or abs(turn) < BEND_RAD or street.profile.one_way:
            continue
        forward = turn < 0
        for step in (-0.5, 0.5, 1.5):
            station = middle + (step if forward else -step) * min(CHEVRON_M, radius_m * 0.5)
            spot = furnisher.beside(street, 1 if forward else -1, station, FROM_KERB_M)
            eye, _ = paths.at(line, station - READ_FROM_M if forward else station + READ_FROM_M)
            towards = np.array(spot[:2]) - eye
            yaw = float(np.arctan2(towards[1], towards[0]) - np.pi / 2)
            furnisher.stand(
                "sign_chevron", kit.traffic_sign("chevron", post_m=0.9), spot[0], spot[1], yaw, 0.1, high=1.6
            )


def crossing_lights(furnisher: Furnisher, street: Street) -> None:
    """A traffic light, red for cars, at the right kerb before each crossing between junctions, in both directions."""
    for middle in furnisher.network.crossings_m(street.name):
        for forward in (True, False):
            sign = 1.0 if forward else -1.0
            station = middle - sign * (CROSSING_M / 2 + STOP_LINE_GAP_M - 0.4)
            light(furnisher, street, station, forward=forward, lit="red" if forward else "green")
            _sign(furnisher, street, "crossing", middle + sign * (CROSSING_M / 2 + 0.6), forward=forward)


def hides_lights(network: Network, street: str, side: int, station: float) -> bool:
    """Whether a tree on a side of a street would hide a crossing's light from approaching drivers."""
    return any(0 < (station - middle) * side < CLEAR_M for middle in network.crossings_m(street))


def light(furnisher: Furnisher, street: Street, station: float, *, forward: bool, lit: str) -> None:
    """One light on a post at the right kerb."""
    x, y, yaw = _at_kerb(furnisher, street, station, forward=forward)
    furnisher.stand(f"light_{lit}", kit.traffic_light(lit=lit), x, y, yaw, 0.15, high=3.0)


def heads(furnisher: Furnisher, name: str) -> None:
    """Street names at the head of a T junction, a little to the right of the arriving drivers."""
    arms, node = furnisher.network.arms(name), np.asarray(furnisher.network.nodes[name].position)
    for arm, _, away in arms:
        others = [(other, way) for other, _, way in arms if other != arm]
        if not others or max(float(-away @ way) for _, way in others) > HEAD_COS:
            continue
        half = max(furnisher.network.streets[other].profile.half_width_m for other, _ in others)
        heading, right = -away, np.array([-away[1], away[0]])
        x, y = (float(v) for v in node + heading * (half + 1.0) + right * 3.2)
        yaw = float(np.arctan2(heading[1], heading[0]) - np.pi / 2)
        furnisher.stand("street_name", kit.street_name_sign(), x, y, yaw, 0.08, high=3.0)


def corner_railings(furnisher: Furnisher, street: Street, *, starts: bool) -> None:
    """Railings along both kerbs behind a wide street's crossing, so that people cross where they should."""
    mouth, line = furnisher.network.mouths[street.name, starts], furnisher.network.lines[street.name]
    total = paths.length(line)
    for side in (1, -1):
        stations = np.linspace(mouth + RAIL_M[0], mouth + RAIL_M[1], 4)
        points = np.array([furnisher.beside(street, side, s if starts else total - s, 0.42)[:2] for s in stations])
        if not all(furnisher.ground.takes(x, y) and furnisher.props.is_free(x, y, 0.25) for x, y in points):
            continue
        solids.railing(furnisher.props.sink, points, KERB_M, "anthracite", "fence", top_m=1.0)
        barrier(furnisher.props.solids, points[[0, -1]], 1.0)
        furnisher.props.spots.extend((float(x), float(y), 0.6) for x, y in points)


def barrier(found: list[Solid], line: Array, height_m: float, *, half_m: float = RAIL_HALF_M) -> None:
    """The solid of a fence or wall between two points (2, 2)."""
    x, y = (float(v) for v in line.mean(0))
    yaw = float(np.arctan2(*(line[1] - line[0])[::-1]))
    turn = (float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2)))
    size = (paths.length(line) / 2, half_m, height_m / 2)
    found.append(Solid(f"fence_{x:.1f}_{y:.1f}", "box", (x, y, KERB_M + height_m / 2), size, turn))


def _sign(furnisher: Furnisher, street: Street, name: str, station: float, *, forward: bool) -> None:
    parts: list[Part] = kit.traffic_sign(name)
    for shift in SHIFTS_M:
        x, y, yaw = _at_kerb(furnisher, street, station + shift, forward=forward)
        if furnisher.ground.takes(x, y) and furnisher.props.is_free(x, y, 0.1):
            furnisher.stand(f"sign_{name}", parts, x, y, yaw, 0.08, high=2.8)
            return


def _at_kerb(furnisher: Furnisher, street: Street, station: float, *, forward: bool) -> tuple[float, float, float]:
    """A point behind the right kerb of a driving direction, and the yaw of a sign that faces the drivers."""
    x, y, toward = furnisher.beside(street, -1 if forward else 1, station, FROM_KERB_M)
    # The road is to the left of the sign's back, so drivers have the sign on their right.
    heading = np.array([toward[1], -toward[0]])
    return x, y, float(np.arctan2(heading[1], heading[0]) - np.pi / 2)
