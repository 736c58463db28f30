"""The road users of one sample: drawn at random, placed on the ground, and checked for overlaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gear.values.errors import PlacementError
from gear.values.geometry import Array, RigidTransform
from gear.values.rng import derive_rng
from gear.world.assets.actor_types import ActorType
from gear.world.placement import PlacementSpace
from gear.world.roads.regions import Region
from gear.world.scene_spec import BoardSpec, NpcLimits, SceneSpec
from gear.world.traffic.footprints import Footprint
from gear.world.traffic.spawn import FreeSlots, Spawn, Spawner

TRIES = 40
"""Number of random positions that are tested for one road user in a round, before the road user is left out."""

ROUNDS = 5
"""Number of rounds of drawing. After each round, road users that overlap are removed; the next round replaces them."""

VEHICLE_GAP_M = (1.5, 0.3)
PERSON_GAP_M = (0.35, 0.35)
"""Smallest gaps between a person and all other road users, metres: in front and behind, and to the sides."""

UPRIGHT = 0.9
"""Smallest z component of an actor's z axis. With a smaller value, the actor has fallen over, or its wheels are on
different levels.
"""

SLIP_M = 0.5
"""Largest distance in metres that an actor may move while it settles on the ground; beyond it, the actor has
slid away.
"""


@dataclass(eq=False, kw_only=True)
class RoadUsers:
    """The road users of one sample while it is being drawn, by the names of their bodies in the placement model.

    Attributes:
        spawns: the road users by body: the ego car, the carrier of the patch if there is one, then all others in the
            order in which they were drawn.
        poses: their poses in world coordinates, by body.
        keep_out: areas in which no other road user may be.
        free: the slots of the pool of actors that are not used yet.
        protected: bodies of the ego car and the carrier, which are never removed.
        required_lanes: lanes that the ego car must follow from its start, by the name of its body.
        drive_m: distance in metres from the ego car's start to the end of its limits; 0 if the ego car stands or has no
            limits.
    """

    spawns: dict[str, Spawn]
    poses: dict[str, RigidTransform]
    keep_out: list[Footprint]
    free: FreeSlots
    protected: frozenset[str] = field(default_factory=frozenset)
    required_lanes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    drive_m: float = 0.0

    def drop(self, body: str) -> None:
        """Removes a road user, so that its entry in the pool of actors is free again.

        Args:
            body: name of the road user's body.
        """
        spawn = self.spawns.pop(body)
        self.poses.pop(body, None)
        self.free.release(spawn.actor_type.facts.name, body)

    def count(self, *, people: bool) -> int:
        """The number of people or of vehicles, without the ego car and the carrier of the patch.

        Args:
            people: True counts people, False counts vehicles.
        """
        return sum(
            (spawn.walk is not None) == people for body, spawn in self.spawns.items() if body not in self.protected
        )


@dataclass(frozen=True, slots=True)
class _Draw:
    """Numbers from which the random generators of one round of drawing are seeded."""

    seed: int
    sequence: int
    attempt: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Crowd:
    """Draws the other road users around the ego car at random.

    Attributes:
        scene_name, scene: the scene, which sets the limits, and its name.
        types: the assets of the pool by name.
        spawner: draws positions.
        space: the placement model, for overlaps.
    """

    scene_name: str
    scene: SceneSpec
    types: Mapping[str, ActorType]
    spawner: Spawner
    space: PlacementSpace

    def fill(
        self, road_users: RoadUsers, seed: int, sequence: int, occlusion_test: OcclusionTest | None = None
    ) -> None:
        """Adds vehicles and people around the ego car. Those that overlap, fall over or hide a face are removed
        and drawn again a few times.

        Args:
            road_users: contains the ego car and the carrier, if there is one; changed in place.
            seed: seed of the split.
            sequence: number of the sample's sequence; together with `seed` it determines all random draws.
            occlusion_test: finds road users that hide a face; None if the scene has no face.

        Raises:
            PlacementError: fewer road users than the smallest count could be placed; the message names the limit that
                is too tight.
        """
        ego = next(iter(road_users.spawns.values()))
        wanted: dict[str, int] = {}
        regions: dict[str, Region] = {}
        for name, limits in self._limits():
            low, high = limits.count
            wanted[name] = int(derive_rng(seed, self.scene_name, name, "count", sequence).integers(low, high + 1))
            regions[name] = region_of(limits, self.scene.boards, (ego.x_m, ego.y_m))
        for attempt in range(ROUNDS):
            draw = _Draw(seed, sequence, attempt)
            fresh = self._draw_vehicles(road_users, regions["npc_vehicles"], wanted["npc_vehicles"], draw)
            fresh += self._draw_people(road_users, regions["pedestrians"], wanted["pedestrians"], draw)
            fell = self._place_on_ground(road_users, fresh)
            if not self._drop_overlapping(road_users, occlusion_test) and not fell:
                break
        for name, limits in self._limits():
            placed = road_users.count(people=name == "pedestrians")
            if placed < limits.count[0]:
                raise PlacementError(
                    self.scene_name,
                    f"{name}.count asks for at least {limits.count[0]}, but only {placed} find a free place within its"
                    f" limits; widen {name}.ahead_m, lateral_m or radius_m, or lower the count",
                )

    def _limits(self) -> tuple[tuple[str, NpcLimits], ...]:
        return ("npc_vehicles", self.scene.npc_vehicles), ("pedestrians", self.scene.pedestrians)

    def _draw_vehicles(self, road_users: RoadUsers, region: Region, wanted: int, draw: _Draw) -> list[str]:
        pieces = self.spawner.lane_table.inside(region)
        bays = self.spawner.bays_inside(region)
        added: list[str] = []
        for number in range(wanted - road_users.count(people=False)):
            rng = derive_rng(draw.seed, self.scene_name, "npc_vehicles", draw.sequence, draw.attempt, number)
            parks = rng.random() < self.scene.npc_vehicles.parked_share
            for _ in range(TRIES):
                actor_type = road_users.free.draw(self.types, rng, people=False)
                if actor_type is None:
                    return added
                body = road_users.free.bodies[actor_type.facts.name][0]
                spawn: Spawn | None = None
                may_park = actor_type.vehicle is not None and not actor_type.vehicle.is_two_wheeler
                if parks and bays and may_park:
                    spawn = self.spawner.in_bay(actor_type, body, bays[int(rng.integers(len(bays)))], rng)
                elif len(pieces) and not parks:
                    lane, s_m = self.spawner.lane_table.draw(pieces, rng)
                    if self.spawner.is_allowed_on(actor_type, lane):
                        spawn = self.spawner.on_lane(actor_type, body, "npc", lane, s_m, rng)
                if spawn is not None and self._add(road_users, spawn, VEHICLE_GAP_M):
                    added.append(body)
                    break
                parks = parks and bool(bays) and rng.random() < 0.9
        return added

    def _draw_people(self, road_users: RoadUsers, region: Region, wanted: int, draw: _Draw) -> list[str]:
        pieces = self.spawner.walk_table.inside(region)
        added: list[str] = []
        if not len(pieces):
            return added
        for number in range(wanted - road_users.count(people=True)):
            rng = derive_rng(draw.seed, self.scene_name, "pedestrians", draw.sequence, draw.attempt, number)
            for _ in range(TRIES):
                actor_type = road_users.free.draw(self.types, rng, people=True)
                if actor_type is None:
                    return added
                body = road_users.free.bodies[actor_type.facts.name][0]
                spawn = self.spawner.on_walk(actor_type, body, pieces, rng)
                if spawn is not None and self._add(road_users, spawn, PERSON_GAP_M):
                    added.append(body)
                    break
        return added

    def _add(self, road_users: RoadUsers, spawn: Spawn, gap_m: tuple[float, float]) -> bool:
        wide = spawn.footprint.grown(*gap_m)
        if any(wide.overlaps(other) for other in road_users.keep_out):
            return False
        if any(_may_touch(wide, other) and wide.overlaps(other.footprint) for other in road_users.spawns.values()):
            return False
        road_users.free.take(spawn.actor_type.facts.name)
        road_users.spawns[spawn.body] = spawn
        return True

    def _place_on_ground(self, road_users: RoadUsers, bodies: Sequence[str]) -> bool:
        """Places actors on the ground, removes those that cannot stand there, and returns whether one was removed."""
        before = len(road_users.spawns)
        uneven: dict[str, RigidTransform] = {}
        for body in bodies:
            spawn = road_users.spawns[body]
            grounded = self.space.ground_pose(spawn.actor_type, spawn.x_m, spawn.y_m, spawn.near_z_m, spawn.yaw_rad)
            if grounded is None or (grounded.is_even and not is_upright(grounded.world_from_actor)):
                road_users.drop(body)
                continue
            road_users.poses[body] = grounded.world_from_actor
            if not grounded.is_even:
                uneven[body] = grounded.world_from_actor
        if uneven:
            for body, pose in self.space.settle(uneven).items():
                if not is_upright(pose) or _distance_m(pose, uneven[body]) > SLIP_M:
                    road_users.drop(body)
                else:
                    road_users.poses[body] = pose
        return len(road_users.spawns) < before

    def _drop_overlapping(self, road_users: RoadUsers, occlusion_test: OcclusionTest | None) -> bool:
        """Removes actors that overlap another actor or the town, or that hide a face; returns whether one was
        removed.
        """
        order = {body: number for number, body in enumerate(road_users.spawns)}
        overlapping = {
            max(pair, key=lambda body: order.get(body, -1)) for pair in self.space.overlaps(road_users.poses)
        }
        if occlusion_test is not None:
            overlapping |= occlusion_test.occluders(self.space, road_users.poses)
        overlapping -= road_users.protected
        for body in sorted(overlapping):
            road_users.drop(body)
        return bool(overlapping)


def _may_touch(footprint: Footprint, other: Spawn) -> bool:
    """A fast test that is False only if the bounding circles of a footprint and of a road user are apart."""
    reach_m = footprint.radius_m + other.actor_type.half_length_m + other.actor_type.half_width_m
    return abs(other.x_m - footprint.x_m) <= reach_m and abs(other.y_m - footprint.y_m) <= reach_m


def is_upright(pose: RigidTransform) -> bool:
    """Whether an actor stands upright enough to drive or walk.

    Args:
        pose: the actor's pose in the world; its z axis may be up to 26 degrees from the vertical.
    """
    return bool(pose.rotation[2, 2] >= UPRIGHT)


def _distance_m(first: RigidTransform, second: RigidTransform) -> float:
    return float(np.linalg.norm(first.translation_m - second.translation_m))


def region_of(limits: NpcLimits, boards: Sequence[BoardSpec], centre_m: tuple[float, float]) -> Region:
    """The region of the ground in which limits allow road users.

    Args:
        limits: the limits of a scene for other vehicles or for people.
        boards: the scene's boards; `ahead_m` and `lateral_m` are relative to the first one.
        centre_m: x and y of the ego car in world coordinates, to which `radius_m` is relative.
    """
    return Region(
        board=boards[0] if boards and limits.needs_board else None,
        ahead_m=limits.ahead_m,
        lateral_m=limits.lateral_m,
        radius_m=limits.radius_m,
        centre_m=centre_m,
    )


@dataclass(frozen=True, slots=True, eq=False)
class OcclusionTest:
    """Finds the road users that hide a face from the reference camera.

    Attributes:
        eye_m: (3,) position of the camera, world coordinates.
        grids_m: for each face, (N, 3) points spread over it.
        min_free: smallest share of each face that road users must leave visible.
    """

    eye_m: Array
    grids_m: tuple[Array, ...]
    min_free: float

    def occluders(self, space: PlacementSpace, poses: Mapping[str, RigidTransform]) -> set[str]:
        """The road users that hide a face. If actors together hide more of a face than allowed, all of them are
        named.

        Args:
            space: the placement model, in which rays are cast from the camera to the points of each face.
            poses: world pose of each actor, by name of its body.

        Returns:
            Names of bodies in the placement model; empty if all faces are visible enough.
        """
        found: set[str] = set()
        for grid_m in self.grids_m:
            occluders = space.occluders(self.eye_m, grid_m, poses)
            hidden = [body for body in occluders if body is not None]
            if len(hidden) > (1 - self.min_free) * len(occluders):
                found.update(hidden)
        return found
