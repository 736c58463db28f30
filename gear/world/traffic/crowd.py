"""Everybody of one sample: drawn, stood up, and free of overlaps."""

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
from gear.world.traffic.spawn import Draft, FreeSlots, Spawner

TRIES = 40
ROUNDS = 5
"""A crowd is drawn, felt for overlaps, and what overlaps is drawn again, so many times."""

VEHICLE_GAP_M = (1.5, 0.3)
PERSON_GAP_M = (0.35, 0.35)
"""Least gap ahead and behind, and to the sides, to everybody else."""

UPRIGHT = 0.9
"""What stands with its z axis lower than this has fallen over, or has its wheels on different levels of the ground."""

SLIP_M = 0.5
"""What moves further than this while it settles has slid off its place."""


@dataclass(eq=False, kw_only=True)
class Cast:
    """Who takes part, and where everybody stands.

    Attributes:
        drafts: by body of the placement model; the ego car first, then the carrier if there is one, then the others in
            the order in which they were drawn.
        poses: by the same bodies.
        keep_out: where nobody else may be.
        free: what is left of the pool.
        leads: bodies of the ego car and the carrier.
        ways: lanes that the ego car must take, from where it starts, by its body.
        way_m: length of its way to the end of its limits, 0 where it only stands or has none.
    """

    drafts: dict[str, Draft]
    poses: dict[str, RigidTransform]
    keep_out: list[Footprint]
    free: FreeSlots
    leads: frozenset[str] = field(default_factory=frozenset)
    ways: dict[str, tuple[str, ...]] = field(default_factory=dict)
    way_m: float = 0.0

    def drop(self, body: str) -> None:
        """Somebody leaves."""
        draft = self.drafts.pop(body)
        self.poses.pop(body, None)
        self.free.give_back(draft.kind.facts.name, body)

    def count(self, *, people: bool) -> int:
        """How many others there are of one sort."""
        return sum((draft.walk is not None) == people for body, draft in self.drafts.items() if body not in self.leads)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Crowd:
    """Fills casts with other road users.

    Attributes:
        scene_name, scene: whose limits hold.
        types: what there is.
        spawner: where they may be.
        space: what feels overlaps.
    """

    scene_name: str
    scene: SceneSpec
    types: Mapping[str, ActorType]
    spawner: Spawner
    space: PlacementSpace

    def fill(self, cast: Cast, seed: int, sequence: int, hiding: HidingTest | None = None) -> None:
        """Adds vehicles and people around the leads of a cast.

        Args:
            cast: has its leads; is changed.
            seed, sequence: what the draws derive from.
            hiding: who stands in the way of the board.

        Raises:
            PlacementError: fewer than the least count could be placed; says which limit is too tight.
        """
        ego = next(iter(cast.drafts.values()))
        wanted: dict[str, int] = {}
        regions: dict[str, Region] = {}
        for name, limits in self._limits():
            low, high = limits.count
            wanted[name] = int(derive_rng(seed, self.scene_name, name, "count", sequence).integers(low, high + 1))
            regions[name] = region_of(limits, self.scene.boards, (ego.x_m, ego.y_m))
        for attempt in range(ROUNDS):
            fresh = self._draw_vehicles(cast, regions["npc_vehicles"], wanted["npc_vehicles"], seed, sequence, attempt)
            fresh += self._draw_people(cast, regions["pedestrians"], wanted["pedestrians"], seed, sequence, attempt)
            fell = self._stand_up(cast, fresh)
            if not self._drop_offenders(cast, hiding) and not fell:
                break
        for name, limits in self._limits():
            placed = cast.count(people=name == "pedestrians")
            if placed < limits.count[0]:
                raise PlacementError(
                    self.scene_name,
                    f"{name}.count asks for at least {limits.count[0]}, but only {placed} find a free place within its"
                    f" limits; widen {name}.ahead_m, lateral_m or radius_m, or lower the count",
                )

    def _limits(self) -> tuple[tuple[str, NpcLimits], ...]:
        return ("npc_vehicles", self.scene.npc_vehicles), ("pedestrians", self.scene.pedestrians)

    def _draw_vehicles(
        self, cast: Cast, region: Region, wanted: int, seed: int, sequence: int, attempt: int
    ) -> list[str]:
        pieces = self.spawner.lane_table.inside(region)
        bays = self.spawner.bays_inside(region)
        added: list[str] = []
        for number in range(wanted - cast.count(people=False)):
            rng = derive_rng(seed, self.scene_name, "npc_vehicles", sequence, attempt, number)
            parks = rng.random() < self.scene.npc_vehicles.parked_share
            for _ in range(TRIES):
                kind = cast.free.draw(self.types, rng, people=False)
                if kind is None:
                    return added
                body = cast.free.bodies[kind.facts.name][0]
                draft: Draft | None = None
                if parks and bays and kind.facts.kind not in ("bicycle", "motorcycle"):
                    draft = self.spawner.in_bay(kind, body, bays[int(rng.integers(len(bays)))], rng)
                elif len(pieces) and not parks:
                    lane, s_m = self.spawner.lane_table.draw(pieces, rng)
                    if self.spawner.belongs(kind, lane):
                        draft = self.spawner.on_lane(kind, body, "npc", lane, s_m, rng)
                if draft is not None and self._add(cast, draft, VEHICLE_GAP_M):
                    added.append(body)
                    break
                parks = parks and bool(bays) and rng.random() < 0.9
        return added

    def _draw_people(
        self, cast: Cast, region: Region, wanted: int, seed: int, sequence: int, attempt: int
    ) -> list[str]:
        pieces = self.spawner.walk_table.inside(region)
        added: list[str] = []
        if not len(pieces):
            return added
        for number in range(wanted - cast.count(people=True)):
            rng = derive_rng(seed, self.scene_name, "pedestrians", sequence, attempt, number)
            for _ in range(TRIES):
                kind = cast.free.draw(self.types, rng, people=True)
                if kind is None:
                    return added
                body = cast.free.bodies[kind.facts.name][0]
                draft = self.spawner.on_walk(kind, body, pieces, rng)
                if draft is not None and self._add(cast, draft, PERSON_GAP_M):
                    added.append(body)
                    break
        return added

    def _add(self, cast: Cast, draft: Draft, gap_m: tuple[float, float]) -> bool:
        wide = draft.footprint.grown(*gap_m)
        if any(wide.overlaps(other) for other in cast.keep_out):
            return False
        if any(wide.overlaps(other.footprint) for other in cast.drafts.values()):
            return False
        cast.free.take(draft.kind.facts.name)
        cast.drafts[draft.body] = draft
        return True

    def _stand_up(self, cast: Cast, bodies: Sequence[str]) -> bool:
        """Puts drafts on the ground and drops who cannot stand there; whether there was anybody."""
        before = len(cast.drafts)
        uneven: dict[str, RigidTransform] = {}
        for body in bodies:
            draft = cast.drafts[body]
            standing = self.space.stand(draft.kind, draft.x_m, draft.y_m, draft.near_z_m, draft.yaw_rad)
            if standing is None or (standing.is_even and not is_upright(standing.world_from_actor)):
                cast.drop(body)
                continue
            cast.poses[body] = standing.world_from_actor
            if not standing.is_even:
                uneven[body] = standing.world_from_actor
        if uneven:
            for body, pose in self.space.settle(uneven).items():
                if not is_upright(pose) or _distance_m(pose, uneven[body]) > SLIP_M:
                    cast.drop(body)
                else:
                    cast.poses[body] = pose
        return len(cast.drafts) < before

    def _drop_offenders(self, cast: Cast, hiding: HidingTest | None) -> bool:
        """Drops who overlaps somebody drawn before, or the town, or hides the board; whether there was anybody."""
        order = {body: number for number, body in enumerate(cast.drafts)}
        offenders = {max(pair, key=lambda body: order.get(body, -1)) for pair in self.space.overlaps(cast.poses)}
        if hiding is not None:
            offenders |= hiding.who(self.space, cast.poses)
        offenders -= cast.leads
        for body in sorted(offenders):
            cast.drop(body)
        return bool(offenders)


def is_upright(pose: RigidTransform) -> bool:
    """Whether an actor stands as it would drive or walk."""
    return bool(pose.rotation[2, 2] >= UPRIGHT)


def _distance_m(first: RigidTransform, second: RigidTransform) -> float:
    return float(np.linalg.norm(first.translation_m - second.translation_m))


def region_of(limits: NpcLimits, boards: Sequence[BoardSpec], centre_m: tuple[float, float]) -> Region:
    """Where limits let somebody be."""
    return Region(
        board=boards[0] if boards and limits.needs_board else None,
        ahead_m=limits.ahead_m,
        lateral_m=limits.lateral_m,
        radius_m=limits.radius_m,
        centre_m=centre_m,
    )


@dataclass(frozen=True, slots=True, eq=False)
class HidingTest:
    """Who stands between the reference camera and the faces.

    Attributes:
        eye_m: the camera.
        grids_m: points spread over each face.
        min_free: share of each face that no road user may hide.
    """

    eye_m: Array
    grids_m: tuple[Array, ...]
    min_free: float

    def who(self, space: PlacementSpace, poses: Mapping[str, RigidTransform]) -> set[str]:
        """Bodies that together hide too much of a face."""
        found: set[str] = set()
        for grid_m in self.grids_m:
            blockers = space.blockers(self.eye_m, grid_m, poses)
            hidden = [body for body in blockers if body is not None]
            if len(hidden) > (1 - self.min_free) * len(blockers):
                found.update(hidden)
        return found
