"""Draws road users at random: asset, position on a lane, walk or parking bay, speed and colour.

`gear.world.placement` computes their poses on the ground afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gear.values.scene import Role, Vec3
from gear.world.assets.actor_types import ActorType
from gear.world.compilation.actor_pool import Slot
from gear.world.roads.lanes import LaneGraph, ParkingBay
from gear.world.roads.regions import LineTable, Region
from gear.world.roads.routes import vehicle_pose
from gear.world.traffic.footprints import Footprint

JUNCTION_WEIGHT = 0.4
"""Probability per metre of a junction lane, relative to other lanes."""

CROSSING_WEIGHT = 2.5
"""Probability per metre of a crosswalk, relative to sidewalks."""

STANDING_SHARE = 0.2
"""Share of the vehicles on lanes outside junctions that stand still, as in a queue."""

MOTORWAY_MPS = 20.0
"""Speed of a lane in m/s from which the lane counts as a motorway. Vehicles that cannot reach this speed are not placed
on a motorway.
"""

SIDE_CLEARANCE_M = 0.35
"""Smallest distance of people from the edge of a sidewalk, metres."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkPlace:
    """The position of a person on a sidewalk or crosswalk.

    Attributes:
        walk: name of the sidewalk or crosswalk.
        s_m: arc length on the line of the walk.
        lateral_m: distance to the left of the line.
        direction: 1 for walking along the line, -1 for walking against it.
    """

    walk: str
    s_m: float
    lateral_m: float
    direction: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Spawn:
    """A road user that was drawn at random: asset, position, speed and colour.

    Attributes:
        role: role in the scene record, such as `ego` or `npc`.
        actor_type: its measured asset.
        body: name of its body in the placement model.
        x_m, y_m: position in world coordinates.
        near_z_m: height near which the ground is searched.
        yaw_rad: heading, counter-clockwise from east.
        speed_mps: speed along the heading.
        paint_rgb: linear albedo of its paint, 0..1; None for an asset without a palette.
        lane: name of the lane on which it drives; "" for people and parked vehicles.
        s_m, lateral_m: arc length on that lane, and distance to the left of it.
        walk: position on a sidewalk or crosswalk; None for vehicles.
    """

    role: Role
    actor_type: ActorType
    body: str
    x_m: float
    y_m: float
    near_z_m: float
    yaw_rad: float
    speed_mps: float = 0.0
    paint_rgb: Vec3 | None = None
    lane: str = ""
    s_m: float = 0.0
    lateral_m: float = 0.0
    walk: WalkPlace | None = None

    @property
    def footprint(self) -> Footprint:
        """The footprint of the road user: the rectangle on the ground that it covers."""
        actor_type = self.actor_type
        return Footprint(
            self.x_m, self.y_m, self.near_z_m, self.yaw_rad, actor_type.half_length_m, actor_type.half_width_m
        )


@dataclass(slots=True, eq=False)
class FreeSlots:
    """The free slots (unused entries) of the pool of actors while a sample is drawn.

    Attributes:
        bodies: bodies of the free slots, by the name of their asset.
    """

    bodies: dict[str, list[str]] = field(default_factory=dict)
    _drawable: dict[bool, tuple[Mapping[str, ActorType], list[ActorType]]] = field(
        default_factory=dict, init=False, repr=False
    )

    @staticmethod
    def of(slots: Sequence[Slot]) -> FreeSlots:
        """Makes an object in which all slots of the pool are free, except the slot of the carrier of the patch.

        Args:
            slots: the pool of actors.
        """
        free = FreeSlots()
        for slot in slots:
            if not slot.carries_surface:
                free.bodies.setdefault(slot.actor.name, []).append(slot.body)
        return free

    def take(self, asset: str) -> str:
        """Takes a free slot of an asset, so that the slot is used, and returns the name of its body.

        Args:
            asset: name of the asset; it must have a free slot.
        """
        return self.bodies[asset].pop(0)

    def release(self, asset: str, body: str) -> None:
        """Makes the slot of a body free again.

        Args:
            asset: name of the asset.
            body: name of the body that was taken.
        """
        self.bodies[asset].append(body)

    def draw(self, types: Mapping[str, ActorType], rng: np.random.Generator, *, people: bool) -> ActorType | None:
        """Draws a random asset that has a free slot; the slot is not taken. The probabilities are proportional to
        the weights of the assets.

        Args:
            types: measured assets by name; the mapping must not be changed between calls.
            rng: random generator.
            people: whether a person is drawn; otherwise a vehicle.

        Returns:
            The asset; None if no asset of this kind has a free slot.
        """
        searched, drawable = self._drawable.get(people, (None, []))
        if searched is not types:  # else dozens of draws per sample would search all types again
            drawable = [
                actor_type
                for name, actor_type in types.items()
                if name in self.bodies and actor_type.is_person == people and actor_type.facts.weight > 0
            ]
            self._drawable[people] = types, drawable
        kinds = [actor_type for actor_type in drawable if self.bodies[actor_type.facts.name]]
        if not kinds:
            return None
        shares = np.cumsum([actor_type.facts.weight for actor_type in kinds])
        return kinds[min(int(np.searchsorted(shares, rng.random() * shares[-1])), len(kinds) - 1)]


def draw_paint(actor_type: ActorType, rng: np.random.Generator) -> Vec3 | None:
    """Draws a random colour from an asset's palette, as linear albedo 0..1; None for an asset without a palette.

    Args:
        actor_type: the asset.
        rng: random generator.
    """
    palette = actor_type.facts.palette
    total = sum(weight for _, weight in palette)
    if total <= 0:
        return None
    shares = np.cumsum([weight for _, weight in palette])
    return palette[min(int(np.searchsorted(shares, rng.random() * total)), len(palette) - 1)][0]


class Spawner:
    """Draws road users at random positions on the lanes, walks and parking bays of one town."""

    def __init__(self, lanes: LaneGraph) -> None:
        """Cuts the lanes and walks of a town into pieces of about a metre, from which positions are drawn.

        Args:
            lanes: the lanes, walks and parking bays of the town.
        """
        self.lanes = lanes
        self.lane_table = LineTable.of(
            (lane.name, lane.line, JUNCTION_WEIGHT if lane.is_junction else 1.0) for lane in lanes.lanes.values()
        )
        self.walk_table = LineTable.of(
            (walk.name, walk.line, CROSSING_WEIGHT if walk.is_crossing else 1.0) for walk in lanes.walks.values()
        )
        self._bays_m = np.array([bay.position_m for bay in lanes.bays]).reshape(-1, 3)

    def bays_inside(self, region: Region) -> list[ParkingBay]:
        """Parking bays whose middle lies inside a region.

        Args:
            region: the region of the ground.
        """
        return (
            [self.lanes.bays[i] for i in np.flatnonzero(region.holds(self._bays_m[:, :2]))] if len(self._bays_m) else []
        )

    def is_allowed_on(self, actor_type: ActorType, lane: str) -> bool:
        """Whether a vehicle may use a lane: vehicles slower than `MOTORWAY_MPS` may not use lanes of a motorway.

        Args:
            actor_type: asset of the vehicle.
            lane: name of the lane.
        """
        vehicle = actor_type.vehicle
        is_slow = vehicle is not None and vehicle.max_speed_mps < MOTORWAY_MPS
        return not is_slow or self.lanes.lanes[lane].speed_mps < MOTORWAY_MPS

    def on_lane(
        self,
        actor_type: ActorType,
        body: str,
        role: Role,
        lane: str,
        s_m: float,
        rng: np.random.Generator,
    ) -> Spawn:
        """Draws a vehicle at a position on a lane: its speed, colour and small deviations from the position.

        The vehicle is shifted from the centre line and turned by small random amounts; two-wheelers keep to the right
        edge. A vehicle with the role `npc` may stand outside of junctions.

        Args:
            actor_type: asset of the vehicle.
            body: name of its body in the placement model.
            role: role in the scene record, such as `ego` or `npc`.
            lane: name of the lane.
            s_m: arc length of the vehicle's middle on this lane, metres.
            rng: random generator.
        """
        road = self.lanes.lanes[lane]
        room_m = max(0.0, road.width_m / 2 - actor_type.half_width_m - 0.2)
        lateral_m = float(np.clip(rng.normal(0.0, 0.12), -room_m, room_m))
        vehicle = actor_type.vehicle
        assert vehicle is not None  # people are never placed on lanes
        if vehicle.is_two_wheeler:
            lateral_m = -room_m * float(rng.uniform(0.3, 0.8))
        point, yaw_rad = vehicle_pose(road.line, s_m, actor_type.half_length_m, lateral_m)
        stands = rng.random() < STANDING_SHARE and not road.is_junction
        most_mps = min(road.speed_mps, vehicle.max_speed_mps)
        speed_mps = most_mps * float(rng.uniform(0.35, 1.0))
        return Spawn(
            role=role,
            actor_type=actor_type,
            body=body,
            x_m=float(point[0]),
            y_m=float(point[1]),
            near_z_m=float(point[2]),
            yaw_rad=yaw_rad + float(np.clip(rng.normal(0.0, 0.01), -0.03, 0.03)),
            speed_mps=0.0 if stands and role == "npc" else speed_mps,
            paint_rgb=draw_paint(actor_type, rng),
            lane=lane,
            s_m=s_m,
            lateral_m=lateral_m,
        )

    def in_bay(self, actor_type: ActorType, body: str, bay: ParkingBay, rng: np.random.Generator) -> Spawn | None:
        """Draws a parked vehicle in a parking bay; None if the bay is too small for the vehicle.

        Args:
            actor_type: asset of the vehicle.
            body: name of the vehicle's body in the pool of actors.
            bay: the parking bay.
            rng: random generator.
        """
        spare_m = bay.length_m / 2 - actor_type.half_length_m, bay.width_m / 2 - actor_type.half_width_m
        if min(spare_m) < 0:
            return None
        ahead_m, left_m = (float(rng.uniform(-1, 1)) * min(0.25, spare) for spare in spare_m)
        c, s = math.cos(bay.yaw_rad), math.sin(bay.yaw_rad)
        turned = math.pi if rng.random() < 0.15 else 0.0
        return Spawn(
            role="parked",
            actor_type=actor_type,
            body=body,
            x_m=bay.position_m[0] + c * ahead_m - s * left_m,
            y_m=bay.position_m[1] + s * ahead_m + c * left_m,
            near_z_m=bay.position_m[2],
            yaw_rad=bay.yaw_rad + turned + float(np.clip(rng.normal(0.0, 0.015), -0.03, 0.03)),
            paint_rgb=draw_paint(actor_type, rng),
        )

    def on_walk(
        self, actor_type: ActorType, body: str, pieces: npt.NDArray[np.intp], rng: np.random.Generator
    ) -> Spawn | None:
        """Draws a person at a random position on a sidewalk or crosswalk.

        People who walk keep to the right half and look along the walk; people who stand look in any direction.

        Args:
            actor_type: asset of the person; its gait decides whether the person walks or stands.
            body: name of the body that the person takes, one of `FreeSlots.bodies`.
            pieces: (N,) indices into `walk_table` of the pieces from which the position is drawn.
            rng: random generator.

        Returns:
            The person; None if a person who stands was drawn on a crosswalk.
        """
        name, s_m = self.walk_table.draw(pieces, rng)
        walk = self.lanes.walks[name]
        if walk.is_crossing and actor_type.facts.gait != "walk":
            return None
        direction = 1 if rng.random() < 0.5 else -1
        room_m = max(0.0, walk.width_m / 2 - SIDE_CLEARANCE_M)
        walks = actor_type.facts.gait == "walk"
        lateral_m = -direction * room_m * float(rng.uniform(0.1, 1.0)) if walks else room_m * float(rng.uniform(-1, 1))
        point, heading_rad = walk.line.at(s_m, lateral_m)
        if direction < 0:
            heading_rad += math.pi
        return Spawn(
            role="pedestrian",
            actor_type=actor_type,
            body=body,
            x_m=float(point[0]),
            y_m=float(point[1]),
            near_z_m=float(point[2]),
            yaw_rad=heading_rad if walks else float(rng.uniform(-math.pi, math.pi)),
            speed_mps=float(rng.uniform(0.8, 1.7)) if walks else 0.0,
            paint_rgb=draw_paint(actor_type, rng),
            walk=WalkPlace(walk=name, s_m=s_m, lateral_m=lateral_m, direction=direction),
        )
