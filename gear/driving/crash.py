"""Detects crashes: the first contact of the ego car's collision model with another road user or with the town."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from gear.values.geometry import RigidTransform
from gear.world.assets.actor_types import ActorType
from gear.world.placement import PlacementSpace
from gear.world.traffic.footprints import Footprint
from gear.world.traffic.spawn import Spawn


@dataclass(frozen=True, slots=True, kw_only=True)
class Crash:
    """The first contact of the ego car.

    Attributes:
        time_s: time since the start of the drive.
        actor_id: id of the other road user in the records; 0 for the town.
        kind: `vehicle`, `person`, or `static` for the town.
        impact_mps: speed of the ego car relative to what it hits.
    """

    time_s: float
    actor_id: int
    kind: str
    impact_mps: float


class CrashDetector:
    """Finds contacts of the ego car: first it compares footprints (rectangles on the ground), then it runs MuJoCo's
    collision detection.
    """

    def __init__(self, space: PlacementSpace, ego_body: str, ego_type: ActorType) -> None:
        """Prepares the detector for the ego car of one drive.

        Args:
            space: the placement model of the world.
            ego_body: name of the ego car's body.
            ego_type: asset of the ego car.
        """
        self._space, self._body, self._type = space, ego_body, ego_type

    def ego_pose(self, x_m: float, y_m: float, near_z_m: float, yaw_rad: float) -> RigidTransform:
        """The ego car's pose on the ground.

        Args:
            x_m: position in world coordinates.
            y_m: position in world coordinates.
            near_z_m: height near which the ground is searched, such as the last known height.
            yaw_rad: direction, counter-clockwise from the world's x axis.

        Returns:
            The transform from `actor` to `world`; level at the height `near_z_m` if there is no ground.
        """
        grounded = self._space.ground_pose(self._type, x_m, y_m, near_z_m, yaw_rad)
        if grounded is None:
            return RigidTransform.from_yaw("world", "actor", (x_m, y_m, near_z_m), yaw_rad)
        return grounded.world_from_actor

    def pose(self, spawn: Spawn) -> RigidTransform:
        """The pose of another road user on the ground.

        Args:
            spawn: the road user with its position and direction.

        Returns:
            The transform from `actor` to `world`; level at the height `spawn.near_z_m` if there is no ground.
        """
        grounded = self._space.ground_pose(spawn.actor_type, spawn.x_m, spawn.y_m, spawn.near_z_m, spawn.yaw_rad)
        if grounded is None:
            place_m = (spawn.x_m, spawn.y_m, spawn.near_z_m)
            return RigidTransform.from_yaw("world", "actor", place_m, spawn.yaw_rad)
        return grounded.world_from_actor

    def footprint(self, x_m: float, y_m: float, z_m: float, yaw_rad: float) -> Footprint:
        """The ego car's footprint, a rectangle on the ground, for a position in world coordinates.

        Args:
            x_m: position.
            y_m: position.
            z_m: height.
            yaw_rad: direction, counter-clockwise from the world's x axis.
        """
        return Footprint(x_m, y_m, z_m, yaw_rad, self._type.half_length_m, self._type.half_width_m)

    def overlapping(self, own: Footprint, spawns: Mapping[str, Spawn]) -> dict[str, Spawn]:
        """The road users whose footprint has a common point with the ego car's footprint `own`.

        Args:
            own: the ego car's footprint.
            spawns: road users by name of their body.
        """
        return {body: spawn for body, spawn in spawns.items() if own.overlaps(spawn.footprint)}

    def hit(self, ego: RigidTransform, spawns: Mapping[str, Spawn]) -> str | None:
        """The name of the body of the road user that the ego car touches; None without a contact.

        Args:
            ego: pose of the ego car.
            spawns: the road users that may be touched, by name of their body.
        """
        for body, spawn in spawns.items():
            pairs = self._space.overlaps({self._body: ego, body: self.pose(spawn)})
            if any(set(pair) == {self._body, body} for pair in pairs):
                return body
        return None

    def hits_town(self, ego: RigidTransform) -> bool:
        """Whether the ego car touches a building, a pole or another fixed object of the town."""
        return any(self._body in pair for pair in self._space.overlaps({self._body: ego}))


def impact_mps(ego_mps: float, ego_yaw_rad: float, spawn: Spawn | None) -> float:
    """Speed in m/s of the ego car relative to what it hits, at the first contact.

    Args:
        ego_mps: speed of the ego car.
        ego_yaw_rad: direction of the ego car, counter-clockwise from the world's x axis.
        spawn: the road user that is hit; None for the town, which does not move.
    """
    vx, vy = ego_mps * math.cos(ego_yaw_rad), ego_mps * math.sin(ego_yaw_rad)
    if spawn is not None:
        vx -= spawn.speed_mps * math.cos(spawn.yaw_rad)
        vy -= spawn.speed_mps * math.sin(spawn.yaw_rad)
    return math.hypot(vx, vy)
