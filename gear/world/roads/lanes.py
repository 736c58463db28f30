"""Lanes, sidewalks, crosswalks and parking bays of a town, read from the custom fields of its MJCF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from gear.values.errors import TownError
from gear.values.geometry import Array
from gear.world.roads.polyline import Polyline
from gear.world.scene_spec import FARTHEST_M

LEAST_SIDE_M = 1.0
"""Smallest width and height of the area that a town covers, metres; maps are drawn to the scale of this area."""

_KINDS = ("lane", "sidewalk", "crosswalk", "parking", "town")
"""First parts of the names of custom fields that are read."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lane:
    """One lane of a town's road network.

    Attributes:
        name: name of its custom field, `lane.…`.
        width_m: width of the lane.
        speed_mps: usual speed.
        line: centre line in the direction of travel.
        next: names of the lanes that continue it; empty at the end of a road.
        left, right: names of the neighbouring lanes in the same direction; "" for no such lane.
        is_junction: whether the lane lies inside a junction.
    """

    name: str
    width_m: float
    speed_mps: float
    line: Polyline
    next: tuple[str, ...]
    left: str
    right: str
    is_junction: bool


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Walk:
    """A sidewalk or a crosswalk, which people use in both directions.

    Attributes:
        name: name of its custom field, `sidewalk.…` or `crosswalk.…`.
        width_m: width of the walk.
        line: centre line.
        is_crossing: whether it is a crosswalk.
    """

    name: str
    width_m: float
    line: Polyline
    is_crossing: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ParkingBay:
    """A parking place for one car.

    Attributes:
        name: name of its row of bays, and its number in the row.
        length_m, width_m: size of the bay.
        position_m: middle of the bay on the ground, world coordinates.
        yaw_rad: heading of a parked car, counter-clockwise from east.
    """

    name: str
    length_m: float
    width_m: float
    position_m: tuple[float, float, float]
    yaw_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePoint:
    """A position on a lane.

    Attributes:
        lane: name of the lane.
        s_m: arc length from the start of the lane.
        lateral_m: distance to the left of the centre line.
    """

    lane: str
    s_m: float
    lateral_m: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LaneGraph:
    """The lanes, walks and parking bays of a town.

    Attributes:
        lanes: lanes by name.
        previous: names of the lanes that lead into a lane, by the name of that lane.
        walks: sidewalks and crosswalks by name.
        bays: parking bays.
        bounds_m: xmin, ymin, xmax, ymax of the area that the town covers, world coordinates.
    """

    lanes: Mapping[str, Lane]
    previous: Mapping[str, tuple[str, ...]]
    walks: Mapping[str, Walk]
    bays: tuple[ParkingBay, ...]
    bounds_m: tuple[float, float, float, float]

    @staticmethod
    def from_model(model: mujoco.MjModel, path: Path) -> LaneGraph:
        """Reads the lane graph of a compiled town.

        Args:
            model: compiled from the town's MJCF, alone or as part of a world.
            path: the town's file, for error messages.

        Raises:
            TownError: a lane, a walk or a row of bays is malformed, or there are no lanes or no bounds.
        """
        lanes: dict[str, Lane] = {}
        walks: dict[str, Walk] = {}
        bays: list[ParkingBay] = []
        bounds: tuple[float, ...] = ()
        texts = _texts(model)
        for name, numbers in _numerics(model).items():
            kind = name.partition(".")[0]
            if kind in _KINDS and not np.isfinite(numbers).all():
                raise TownError(path, f"{name} holds something that is no number (nan or inf)")
            if kind == "lane":
                lanes[name] = _lane(name, numbers, texts.get(name, ""), path)
            elif kind in ("sidewalk", "crosswalk"):
                width_m, line = _line(name, numbers, 1, path)
                walks[name] = Walk(name=name, width_m=width_m[0], line=line, is_crossing=kind == "crosswalk")
            elif kind == "parking":
                bays += _bays(name, numbers, path)
            elif name == "town.bounds":
                bounds = tuple(float(v) for v in numbers)
        if not lanes:
            raise TownError(path, "has no lanes (numeric custom fields named lane.…)")
        if len(bounds) != 4 or bounds[0] >= bounds[2] or bounds[1] >= bounds[3]:
            raise TownError(path, "town.bounds must be xmin ymin xmax ymax")
        _check_near("town.bounds", np.array(bounds), path)
        if min(bounds[2] - bounds[0], bounds[3] - bounds[1]) < LEAST_SIDE_M:
            raise TownError(path, f"town.bounds must be at least {LEAST_SIDE_M:g} m wide both ways; it is in metres")
        for name in texts:
            if name.partition(".")[0] == "lane" and name not in lanes:
                raise TownError(path, f"has a text for {name}, but no numeric of that name")
        _check_links(lanes, path)
        previous: dict[str, tuple[str, ...]] = dict.fromkeys(lanes, ())
        for lane in lanes.values():
            for follower in lane.next:
                previous[follower] += (lane.name,)
        box = (bounds[0], bounds[1], bounds[2], bounds[3])
        return LaneGraph(lanes=lanes, previous=previous, walks=walks, bays=tuple(bays), bounds_m=box)

    @property
    def lowest_m(self) -> float:
        """Height in metres of the lowest point of any lane, walk or parking bay."""
        lines = [lane.line for lane in self.lanes.values()] + [walk.line for walk in self.walks.values()]
        heights_m = [float(line.points_m[:, 2].min()) for line in lines]
        return min(heights_m + [bay.position_m[2] for bay in self.bays])

    def project(self, position_m: Array) -> LanePoint:
        """Finds the point on the lanes that is nearest to a position (3,) in world coordinates.

        The distance is measured in 3D, so a lane on a bridge is far from a car below it.

        Args:
            position_m: (3,) position.
        """
        best: tuple[float, LanePoint] | None = None
        for lane in self.lanes.values():
            s_m, lateral_m, distance_m = lane.line.project(position_m)
            if best is None or distance_m < best[0]:
                best = (distance_m, LanePoint(lane=lane.name, s_m=s_m, lateral_m=lateral_m))
        assert best is not None  # there is no graph without lanes
        return best[1]


def _numerics(model: mujoco.MjModel) -> dict[str, Array]:
    found: dict[str, Array] = {}
    for index in range(model.nnumeric):
        start, size = model.numeric_adr[index], model.numeric_size[index]
        found[model.numeric(index).name] = np.array(model.numeric_data[start : start + size])
    return found


def _texts(model: mujoco.MjModel) -> dict[str, str]:
    found: dict[str, str] = {}
    for index in range(model.ntext):
        start, size = model.text_adr[index], model.text_size[index]
        name = model.names[model.name_textadr[index] :].split(b"\0", 1)[0].decode()
        found[name] = bytes(model.text_data[start : start + size]).rstrip(b"\0").decode()
    return found


def _check_near(name: str, places_m: Array, path: Path) -> None:
    if np.abs(places_m).max() > FARTHEST_M:
        farthest_m = float(places_m.flat[np.abs(places_m).argmax()])
        raise TownError(
            path,
            f"{name} reaches {farthest_m:g} m, and nothing may lie beyond {FARTHEST_M:g} m along any axis; are those"
            " metres, and is the town about its origin?",
        )


def _line(name: str, numbers: Array, leading: int, path: Path) -> tuple[tuple[float, ...], Polyline]:
    head, rest = numbers[:leading], numbers[leading:]
    if len(rest) < 6 or len(rest) % 3:
        raise TownError(path, f"{name} needs at least two points of three numbers after its first {leading}")
    if any(value <= 0 for value in head):
        raise TownError(path, f"{name} must have a width and a speed above 0, got {' '.join(f'{v:g}' for v in head)}")
    points = rest.reshape(-1, 3)
    _check_near(name, points, path)
    gaps_m = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    if gaps_m.min() < 1e-4:
        raise TownError(path, f"{name} has two points in one place (point {int(np.argmin(gaps_m)) + 1})")
    return tuple(float(v) for v in head), Polyline.through(points)


def _lane(name: str, numbers: Array, text: str, path: Path) -> Lane:
    (width_m, speed_mps), line = _line(name, numbers, 2, path)
    fields = {"next": "", "left": "", "right": "", "kind": ""}
    for word in text.split():
        key, equals, value = word.partition("=")
        if not equals or key not in fields:
            raise TownError(path, f"{name}: cannot read {word!r}; expected next=, left=, right= or kind=")
        fields[key] = value
    if fields["kind"] not in ("", "junction"):
        raise TownError(path, f"{name}: kind must be junction or absent, got {fields['kind']!r}")
    return Lane(
        name=name,
        width_m=width_m,
        speed_mps=speed_mps,
        line=line,
        next=tuple(word for word in fields["next"].split(",") if word),
        left=fields["left"],
        right=fields["right"],
        is_junction=fields["kind"] == "junction",
    )


def _bays(name: str, numbers: Array, path: Path) -> list[ParkingBay]:
    if len(numbers) < 6 or (len(numbers) - 2) % 4 or min(numbers[:2]) <= 0:
        raise TownError(path, f"{name} must be length and width above 0, then x y z yaw_deg of each bay")
    length_m, width_m = float(numbers[0]), float(numbers[1])
    _check_near(name, numbers[2:].reshape(-1, 4)[:, :3], path)
    return [
        ParkingBay(
            name=f"{name}_{index}",
            length_m=length_m,
            width_m=width_m,
            position_m=(float(x), float(y), float(z)),
            yaw_rad=math.radians(yaw_deg),
        )
        for index, (x, y, z, yaw_deg) in enumerate(numbers[2:].reshape(-1, 4))
    ]


JOIN_TOLERANCE_M = 0.5


def _check_links(lanes: Mapping[str, Lane], path: Path) -> None:
    for lane in lanes.values():
        for link, names in (("next", lane.next), ("left", (lane.left,)), ("right", (lane.right,))):
            for name in names:
                if name and name not in lanes:
                    raise TownError(path, f"{lane.name}: {link} names {name}, which is not there")
        for name in lane.next:
            gap_m = float(np.linalg.norm(lanes[name].line.points_m[0] - lane.line.points_m[-1]))
            if gap_m > JOIN_TOLERANCE_M:
                raise TownError(path, f"{lane.name}: next names {name}, which starts {gap_m:.1f} m from its end")
