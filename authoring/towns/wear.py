"""Traces of use on asphalt: wheel tracks, oil, patches, trenches, and cracks with their seals.

Everything lies on the carriageway in sheets of its own height, all lower than the paint, so that no two of them meet.
The asphalt below the tracks is kept: cutting it out of the road did not make rendering measurably faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]

from authoring.kit.parts import Sink
from authoring.towns import bridges, paths, solids
from authoring.towns.network import Network, Street
from authoring.towns.regions import Regions

Array = npt.NDArray[np.float64]
LANE_LIFT_M, PATCH_LIFT_M, SEAL_LIFT_M = 0.001, 0.002, 0.003
LABEL = "road"
TILE_M = solids.tile_m_of("asphalt_lane")
LONGEST_M = 30.0
CRACK_STEP_M = 0.32
SEAM_M, CRACK_M, HAIRLINE_M = 0.045, 0.042, 0.011
EDGE_M = 0.35
# How far before and behind a place its marks may reach.
REACH_M = (5.0, 16.0)
# Metres of street to one of each, on a street of middle age.
PATCH_EVERY_M, ACROSS_EVERY_M, TRANSVERSE_EVERY_M, ALONG_EVERY_M, HAIRLINE_EVERY_M = 24.0, 70.0, 14.0, 18.0, 5.0
# Wider roads are not dug up from side to side.
WIDEST_DUG_M = 9.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Carriageway:
    """A stretch of road in its own coordinates: metres along its line, and to the left of it.

    Attributes:
        line: its line (N, 2).
        span: from which to which distance along the line it goes.
        lanes: how far left of the line the middle of each lane runs.
        lane_m: width of a lane.
        half_m: from the line to either edge.
        height_m: height of the surface at distances along the line.
        bridge: between which distances it is not level; equal for a level road.
        lift_m: how much higher its marks lie than those of roads that it meets.
    """

    line: Array
    span: tuple[float, float]
    lanes: tuple[float, ...]
    lane_m: float
    half_m: float
    height_m: Callable[[Array], Array]
    bridge: tuple[float, float] = (0.0, 0.0)
    lift_m: float = 0.0

    def piece(self, start_m: float, end_m: float) -> tuple[Array, Array]:
        """Points (N, 2) and their distances (N,); on a bridge, which is straight, where the deck has its folds."""
        line = paths.densified(paths.cut(self.line, start_m, end_m), LONGEST_M)
        stations = paths.stations(line) + start_m
        low, high = self.bridge
        if low < high:
            folds = np.linspace(low, high, int(np.ceil((high - low) / bridges.STEP_M - 1e-6)) + 1)
            beside = stations[(stations < low - 1e-3) | (stations > high + 1e-3)]
            ends = np.array([start_m, end_m])
            inner = folds[(folds > start_m + 1e-3) & (folds < end_m - 1e-3)]
            stations = np.unique(np.concatenate([beside, inner, ends]))
            line = np.array([paths.at(self.line, float(station))[0] for station in stations])
        return line, stations

    def points(self, stations: Array, left: Array, lift_m: float) -> Array:
        """Places (N, 3) by distance along and to the left."""
        at = [paths.at(self.line, float(station)) for station in stations]
        plan = np.array([p + side * np.array([-d[1], d[0]]) for (p, d), side in zip(at, left, strict=True)])
        return np.column_stack([plan, self.height_m(stations) + self.lift_m + lift_m])

    def edges(self, start_m: float, end_m: float, left_m: float, width_m: float, lift_m: float) -> tuple[Array, Array]:
        """The left and right edge (N, 3) of a strip along the road."""
        line, stations = self.piece(start_m, end_m)
        z = (self.height_m(stations) + self.lift_m + lift_m)[:, None]
        left, right = (np.hstack([paths.offset(line, left_m + side * width_m / 2), z]) for side in (1, -1))
        return left, right

    def is_level(self, start_m: float, end_m: float) -> bool:
        """Whether a stretch keeps off the bridge."""
        return end_m < self.bridge[0] or start_m > self.bridge[1] or self.bridge[0] >= self.bridge[1]


def of_street(network: Network, street: Street) -> Carriageway:
    """The carriageway of a street between its junctions."""
    profile = street.profile
    lanes = [profile.lane_offset_m(index, forward=True) for index in range(profile.forward)]
    lanes += [profile.lane_offset_m(index, forward=False) for index in range(profile.backward)]
    return Carriageway(
        line=network.lines[street.name],
        span=network.span(street.name),
        lanes=tuple(lanes),
        lane_m=profile.lane_m,
        half_m=profile.half_width_m,
        height_m=lambda stations: network.height_m(street.name, stations),
        bridge=network.ramp(street.name) if street.hump_m else (0.0, 0.0),
    )


def wear_streets(sink: Sink, regions: Regions, *, seed: int) -> None:
    """Wear every street and junction of a town; each has its own age and its own marks."""
    network = regions.network
    for index, street in enumerate(network.streets.values()):
        wear(sink, of_street(network, street), rng=np.random.default_rng([seed, 100, index]))
    for index, node in enumerate(network.nodes.values()):
        _junction(sink, regions.carriageways, np.asarray(node.position), rng=np.random.default_rng([seed, 101, index]))


def wear(sink: Sink, road: Carriageway, *, rng: np.random.Generator) -> None:
    """Lay tracks, patches, trenches and cracks on one carriageway."""
    start, end = road.span
    if end - start < 3 * TILE_M + 1:
        return
    for left in road.lanes:
        _tracks(sink, road, left)
    age = float(rng.choice([0.45, 1.0, 1.7]))
    for station in _places(road, PATCH_EVERY_M / age, rng):
        length, width = float(rng.uniform(0.8, 4.5)), float(rng.uniform(0.7, 2.2))
        _patch(sink, road, station, _somewhere(road, width, rng), length, width, rng)
    if end - start > 45 and rng.uniform() < 0.35 + 0.2 * age:
        length = float(rng.uniform(0.3, 0.75)) * (end - start)
        station = float(rng.uniform(start, end - length))
        _trench(sink, road, station, station + length, _somewhere(road, 0.8, rng), float(rng.uniform(0.55, 0.85)))
    for station in _places(road, ACROSS_EVERY_M / age, rng) if road.half_m < WIDEST_DUG_M else ():
        reach = 2 * (road.half_m - EDGE_M)
        _patch(sink, road, station, 0.0, float(rng.uniform(0.5, 0.8)), reach, rng)
    for station in _places(road, TRANSVERSE_EVERY_M / age, rng):
        low, high = -road.half_m + EDGE_M, road.half_m - EDGE_M
        if rng.uniform() < 0.5:
            low, high = (low, 0.0) if rng.uniform() < 0.5 else (0.0, high)
        _crack(sink, road, (station, low), (station + float(rng.normal(0, 0.5)), high), CRACK_M, rng)
    for station in _places(road, ALONG_EVERY_M / age, rng):
        left, length = _somewhere(road, 0.4, rng), min(float(rng.uniform(3, 14)), end - station)
        _crack(sink, road, (station, left), (station + length, left + float(rng.normal(0, 0.15))), CRACK_M, rng)
    for station in _places(road, HAIRLINE_EVERY_M / age, rng):
        left, heading = _somewhere(road, 1.5, rng), float(rng.uniform(0, 2 * np.pi))
        along, aside = float(rng.uniform(0.8, 3.0)) * np.array([np.cos(heading), 0.6 * np.sin(heading)])
        _crack(sink, road, (station, left), (station + along, left + aside), HAIRLINE_M, rng)


def _places(road: Carriageway, every_m: float, rng: np.random.Generator) -> Iterator[float]:
    """Distances along a road, `every_m` apart in the mean, none within reach of its ends or on a bridge."""
    start, end = road.span
    station = start + 1.5
    before, behind = REACH_M
    while (station := station + float(rng.exponential(every_m))) < end - before:
        if road.is_level(station - before, station + behind):
            yield station


def _somewhere(road: Carriageway, width_m: float, rng: np.random.Generator) -> float:
    """The middle of a strip of some width, within a lane."""
    room = max(road.lane_m - width_m - 0.3, 0.0) / 2
    return float(rng.choice(np.asarray(road.lanes))) + float(rng.uniform(-room, room))


def _tracks(sink: Sink, road: Carriageway, left_m: float) -> None:
    """A lane's wheel tracks and the line of oil between them, which fade out a tile before both ends."""
    start, end = road.span
    whole = int((end - start - 2 * TILE_M) // TILE_M)
    fade = (end - start - whole * TILE_M) / 2
    # From where to where a piece goes, and v there: both end pieces fade outwards.
    for a, b, tiles, material in (
        (start + fade, start, 1.0, "asphalt_lane_end"),
        (start + fade, end - fade, float(whole), "asphalt_lane"),
        (end - fade, end, 1.0, "asphalt_lane_end"),
    ):
        low, high = min(a, b), max(a, b)
        left, right = road.edges(low, high, left_m, road.lane_m, LANE_LIFT_M)
        v = tiles * (road.piece(low, high)[1] - a) / (b - a)
        half_u = road.lane_m / 2 / TILE_M
        uvs = [np.column_stack([np.full(len(v), u), v]) for u in (0.5 - half_u, 0.5 + half_u)]
        solids.ribbon(sink, left, right, material, LABEL, uvs=np.concatenate(uvs))


def _patch(
    sink: Sink, road: Carriageway, station: float, left: float, length: float, width: float, rng: np.random.Generator
) -> None:
    """A rectangle of newer asphalt, not quite square, with a seam of bitumen round it."""
    corners = np.array([[0, 0.5], [0, -0.5], [1, -0.5], [1, 0.5]]) * (length, width) + (station, left)
    corners = corners + rng.uniform(-0.04, 0.04, (4, 2))
    material = "asphalt_fresh" if rng.uniform() < 0.7 else "asphalt_patch"
    points = road.points(corners[:, 0], corners[:, 1], PATCH_LIFT_M)
    sink.polygon(material, points, points[:, :2] / TILE_M, label=LABEL)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        _strip(sink, road, np.stack([a, b]), np.full(2, SEAM_M))


def _trench(sink: Sink, road: Carriageway, start: float, end: float, left: float, width: float) -> None:
    """A strip along the road where a pipe or cable was laid."""
    if not road.is_level(start, end):
        return
    solids.ribbon(sink, *road.edges(start, end, left, width, PATCH_LIFT_M), "asphalt_fresh", LABEL)
    stations = road.piece(start, end)[1]
    for side in (1, -1):
        track = np.column_stack([stations, np.full(len(stations), left + side * width / 2)])
        _strip(sink, road, track, np.full(len(stations), SEAM_M))


def _crack(
    sink: Sink,
    road: Carriageway,
    begin: tuple[float, float],
    end: tuple[float, float],
    width_m: float,
    rng: np.random.Generator,
) -> None:
    """A wandering line between two places (distance, left): sealed with bitumen where it is wide."""
    track, widths = _wander(np.array(begin), np.array(end), width_m, rng)
    track[:, 0] = track[:, 0].clip(*road.span)
    track[:, 1] = track[:, 1].clip(-road.half_m + EDGE_M, road.half_m - EDGE_M)
    _strip(sink, road, track, widths)


def _wander(begin: Array, end: Array, width_m: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Points (N, 2) from one place to another and the width (N,) at each, which ends in nothing."""
    span = end - begin
    length = float(np.linalg.norm(span))
    count = max(4, int(length / CRACK_STEP_M) + 1)
    share = np.linspace(0, 1, count)
    sway = np.cumsum(rng.normal(0, 0.066, count))
    sway -= sway[0] + share * (sway[-1] - sway[0])
    normal = np.array([-span[1], span[0]]) / max(length, 1e-6)
    widths = width_m * rng.uniform(0.7, 1.3, count)
    widths[[0, -1]] = 0.3 * width_m
    return begin + share[:, None] * span + sway[:, None] * normal, widths


def _strip(sink: Sink, road: Carriageway, track: Array, widths: Array) -> None:
    """A band of bitumen along a track of (distance, left)."""
    _band(sink, road.points(track[:, 0], track[:, 1], SEAL_LIFT_M), widths)


def _band(sink: Sink, points: Array, widths: Array) -> None:
    along = np.gradient(points[:, :2], axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.stack([-along[:, 1], along[:, 0], np.zeros(len(along))], 1) * widths[:, None] / 2
    solids.ribbon(sink, points + normal, points - normal, "asphalt_seal", LABEL)


def _junction(sink: Sink, asphalt: BaseGeometry, centre: Array, *, rng: np.random.Generator) -> None:
    """Sealed cracks across the middle of a junction."""
    for _ in range(int(rng.integers(1, 4))):
        heading, at = float(rng.uniform(0, np.pi)), centre + rng.uniform(-1.5, 1.5, 2)
        reach = float(rng.uniform(1.2, 2.4)) * np.array([np.cos(heading), np.sin(heading)])
        track, widths = _wander(at - reach, at + reach, CRACK_M, rng)
        if asphalt.contains(LineString(track).buffer(EDGE_M)):
            _band(sink, np.column_stack([track, np.full(len(track), SEAL_LIFT_M)]), widths)
