"""Draws the ego car of a sample at random, and the truck in front of it if the scene has one.

All other road users are placed around the ego car afterwards (`gear.world.traffic.crowd`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from gear.values.errors import PlacementError
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.rng import derive_rng
from gear.values.scene import Pose
from gear.world.assets.actor_types import ActorType
from gear.world.assets.scene_assets import EGO_ASSET
from gear.world.compilation.actor_pool import Slot
from gear.world.placement import PlacementSpace
from gear.world.roads.regions import Region
from gear.world.roads.routes import trace_back, vehicle_pose
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.patch_faces import Face
from gear.world.surfaces.view_limits import FaceInWorld, Verdict, ViewLimits, reference_camera
from gear.world.traffic.crowd import RoadUsers, is_upright
from gear.world.traffic.footprints import Footprint
from gear.world.traffic.spawn import FreeSlots, Spawn, Spawner

EGO_TRIES = 60
LONGEST_WAY_M = 40.0
USUAL_MPS = 5.0
"""Speed in m/s from which the start of a driving ego car is computed. The car starts before its limits by at most the
distance that it drives at this speed, and by at most `LONGEST_WAY_M`.
"""

CAMERA_ADVICE = (
    "a level camera with a field of view of 90 degrees would have it in view: change options.pitch_deg,"
    " options.roll_deg, options.hfov_deg, options.focal_px, options.principal_px or options.position_m"
)
"""End of an error message: the advice for the case that the camera's options, and not the scene's limits, keep the
faces out of the picture.
"""

CORRIDOR_M = 1.3
"""Half the width of the strip between the ego car and its truck in which no other road user may be, metres."""


@dataclass(eq=False, kw_only=True)
class EgoSampler:
    """Draws ego cars, and trucks that carry the patch, for one scene.

    Attributes:
        scene_name, scene: the scene, which sets the limits, and its name.
        rig: the cameras on the ego car.
        types: the assets of the pool by name.
        slots: the pool of actors.
        faces: the faces that show patches.
        spawner: draws positions.
        space: the placement model, for overlaps and lines of sight.
    """

    scene_name: str
    scene: SceneSpec
    rig: Rig
    types: Mapping[str, ActorType]
    slots: Sequence[Slot]
    faces: Sequence[Face]
    spawner: Spawner
    space: PlacementSpace

    def draw(self, seed: int, sequence: int, duration_s: float = 0.0) -> RoadUsers:
        """Draws the ego car, and the truck that carries the patch if the scene has one.

        Args:
            seed: seed of the split.
            sequence: number of the sample's sequence; together with `seed` it determines all random draws.
            duration_s: length of the sequence in seconds, 0 for a single picture. In a sequence, the ego car starts at
                or before the start of its limits, from where the boards are visible, and drives to the end of its
                limits.

        Returns:
            The ego car and the truck; all other road users are still missing.

        Raises:
            PlacementError: no drawn position is within the limits; the message names the limit that is too tight.
        """
        problems: Counter[str] = Counter()
        camera_is_cause = 0
        for attempt in range(EGO_TRIES):
            road_users = self.empty()
            # Each failure moves the start nearer to the limits, so that the last tries start with the board in view.
            before_s = duration_s * 0.5 ** (attempt // 6)
            problem = self._place(road_users, derive_rng(seed, self.scene_name, "ego", sequence, attempt), before_s)
            if problem is None:
                return road_users
            problems[problem] += 1
            if problem == "with a face out of the picture":
                camera_is_cause += self.judge(road_users, self._level_rig) != "out of the picture"
        found = ", ".join(f"{count} {what}" for what, count in problems.most_common())
        advice = CAMERA_ADVICE if camera_is_cause > EGO_TRIES // 2 else self._advice
        raise PlacementError(self.scene_name, f"no place for the ego car in {EGO_TRIES} tries ({found}); {advice}")

    def empty(self) -> RoadUsers:
        """An object without road users, in which all entries of the pool of actors are free."""
        return RoadUsers(spawns={}, poses={}, keep_out=[], free=FreeSlots.of(self.slots))

    def enter(self, road_users: RoadUsers, spawns: Sequence[Spawn]) -> str | None:
        """Places the ego car and the carrier of the patch on the ground, and adds them to `road_users`.

        Args:
            road_users: the object to which they are added; changed in place, also if a position is not valid.
            spawns: the ego car, then the carrier if there is one.

        Returns:
            The reason why a position is not valid; None if all positions are valid.
        """
        for spawn in spawns:
            grounded = self.space.ground_pose(spawn.actor_type, spawn.x_m, spawn.y_m, spawn.near_z_m, spawn.yaw_rad)
            if grounded is None:
                return "without ground below"
            pose = grounded.world_from_actor
            if not grounded.is_even:
                pose = self.space.settle({spawn.body: pose})[spawn.body]
            if not is_upright(pose):
                return "tipping over"
            road_users.spawns[spawn.body] = spawn
            road_users.poses[spawn.body] = pose
        road_users.protected = frozenset(road_users.spawns)
        if self.space.overlaps(road_users.poses):
            return "overlapping the town or a board"
        return None

    def judge(self, road_users: RoadUsers, rig: Rig | None = None) -> Verdict:
        """Tests whether the faces are well visible to the reference camera of the ego car.

        Args:
            road_users: contains the ego car, and the carrier if there is one.
            rig: cameras that replace the sampler's rig in this test; None for the sampler's rig.

        Returns:
            `seen`, or the first limit that a face breaks: `out of the picture`, `too oblique` or `hidden`.
        """
        ego = next(iter(road_users.spawns))
        mount, camera = reference_camera(
            rig or self.rig, Pose.from_transform(road_users.poses[ego]).transform("world", "ego")
        )
        return self.limits.judge(self.space, self.faces_in_world(road_users), mount, camera)

    def faces_in_world(self, road_users: RoadUsers) -> list[FaceInWorld]:
        """The faces in world coordinates, on boards or on the carrier at its pose.

        Args:
            road_users: contains the carrier if there is one.

        Returns:
            One entry for each face, in patch order.
        """
        placed = []
        for face in self.faces:
            frame = face.parent_from_surface
            if face.is_carried:
                carrier = next(body for body, spawn in road_users.spawns.items() if spawn.role == "carrier")
                frame = road_users.poses[carrier] @ frame
            placed.append(FaceInWorld.of(face, frame))
        return placed

    @property
    def ego_type(self) -> ActorType:
        """The measured asset of the ego car."""
        return self.types[EGO_ASSET]

    @cached_property
    def limits(self) -> ViewLimits:
        """The limits for the visibility of the faces to the reference camera."""
        if self.scene.ego is None:
            return ViewLimits()
        return ViewLimits(max_incidence_deg=self.scene.ego.max_incidence_deg, min_free=self.scene.ego.min_free)

    @property
    def _advice(self) -> str:
        if self.scene.truck is not None:
            return "widen truck.gap_m"
        return "widen ego.ahead_m or ego.lateral_m" if self.scene.boards else "the town's lanes are blocked"

    def _place(self, road_users: RoadUsers, rng: np.random.Generator, before_s: float) -> str | None:
        if self.scene.truck is not None:
            spawns = self._draw_behind_truck(road_users, rng)
        else:
            spawns = self._draw_alone(road_users, rng, before_s)
        if isinstance(spawns, str):
            return spawns
        problem = self.enter(road_users, spawns)
        if problem is not None or not self.faces:
            return problem
        verdict = self.judge(road_users)
        return None if verdict == "seen" else f"with a face {verdict}"

    def _draw_alone(self, road_users: RoadUsers, rng: np.random.Generator, before_s: float) -> list[Spawn] | str:
        lane, s_m = self.spawner.lane_table.draw(self.places, rng)
        lanes: tuple[str, ...] = (lane,)
        if self.scene.boards and before_s > 0:
            first_m, last_m = self._run(lane, s_m)
            s_m = first_m + float(rng.uniform(0.0, 0.15)) * (last_m - first_m)
            before_m = float(rng.uniform(0.4, 0.8)) * min(LONGEST_WAY_M, before_s * USUAL_MPS)
            road_users.drive_m = before_m + last_m - s_m
            way = trace_back(self.spawner.lanes, lane, s_m, before_m, rng)
            if way is None:
                return "before the start of the road"
            lanes, s_m = way
        ego = self.ego_on_lane(road_users, lanes[0], s_m, rng)
        road_users.required_lanes[ego.body] = lanes
        return [ego]

    def _run(self, lane: str, s_m: float) -> tuple[float, float]:
        """Arc lengths of the first and the last piece of the unbroken run of allowed pieces around a position on
        a lane.
        """
        table = self.spawner.lane_table
        pieces = np.array([piece for piece in self.places if table.names[piece] == lane])
        here = int(pieces[np.argmin(np.abs(table.s_m[pieces] - s_m))])
        inside = set(pieces.tolist())
        first = last = here
        while first - 1 in inside:
            first -= 1
        while last + 1 in inside:
            last += 1
        return float(table.s_m[first]), float(table.s_m[last])

    def ego_on_lane(self, road_users: RoadUsers, lane: str, s_m: float, rng: np.random.Generator) -> Spawn:
        """Draws the ego car at arc length `s_m` on a lane, and marks its entry in the pool of actors as used.

        Args:
            road_users: the road users of the sample.
            lane: name of the lane.
            s_m: arc length on the lane in metres.
            rng: random generator.

        Returns:
            The ego car, which is not yet added to `road_users`.
        """
        return self.spawner.on_lane(self.ego_type, road_users.free.take(EGO_ASSET), "ego", lane, s_m, rng)

    def _draw_behind_truck(self, road_users: RoadUsers, rng: np.random.Generator) -> list[Spawn] | str:
        assert self.scene.truck is not None
        slot = next(slot for slot in self.slots if slot.carries_surface)
        actor_type = self.types[slot.actor.name]
        lane, s_m = self.spawner.lane_table.draw(self.places, rng)
        truck = self.spawner.on_lane(actor_type, slot.body, "carrier", lane, s_m, rng)
        gap_m = float(rng.uniform(*self.scene.truck.gap_m))
        way = trace_back(self.spawner.lanes, lane, s_m, actor_type.rear_m + gap_m + self.ego_type.front_m, rng)
        if way is None:
            return "before the start of the road"
        lanes, ego_s_m = way
        ego = self.ego_on_lane(road_users, lanes[0], ego_s_m, rng)
        road_users.keep_out.append(_between(ego, truck))
        road_users.required_lanes[ego.body] = lanes
        return [ego, truck]

    @cached_property
    def places(self) -> npt.NDArray[np.intp]:
        """The (N,) indices into `spawner.lane_table` of the pieces of lanes on which the ego car may be. In a
        scene with a truck, they are those of the truck.

        Raises:
            PlacementError: there are no such pieces; the message gives the reason why the pieces within the limits are
                excluded.
        """
        table = self.spawner.lane_table
        ego = self.scene.ego
        if ego is None:
            return np.flatnonzero([not self.spawner.lanes.lanes[name].is_junction for name in table.names])
        board = self.scene.boards[0]
        inside = table.inside(Region(board=board, ahead_m=ego.ahead_m, lateral_m=ego.lateral_m))
        if not len(inside):
            raise PlacementError(self.scene_name, f"no lane lies within ego.ahead_m and ego.lateral_m; {self._advice}")
        verdicts = [self._judge_piece(int(piece)) for piece in inside]
        seen = inside[[verdict == "seen" for verdict in verdicts]]
        if not len(seen):
            found = ", ".join(f"{count} have a face {what}" for what, count in Counter(verdicts).most_common())
            with_level = [self._judge_piece(int(piece), self._level_rig) for piece in inside]
            advice = CAMERA_ADVICE if "seen" in with_level else self._advice
            raise PlacementError(
                self.scene_name, f"of {len(inside)} m of lanes within the ego car's limits {found}; {advice}"
            )
        return seen

    @cached_property
    def _level_rig(self) -> Rig:
        """An ordinary camera in the position of the reference camera: level, with a field of view of 90 degrees."""
        mount = self.rig.cameras[0]
        return Rig(cameras=(CameraMount(name=mount.name, width_px=mount.width_px, height_px=mount.height_px),))

    def _judge_piece(self, piece: int, rig: Rig | None = None) -> Verdict:
        table = self.spawner.lane_table
        line = self.spawner.lanes.lanes[table.names[piece]].line
        point, yaw_rad = vehicle_pose(line, float(table.s_m[piece]), self.ego_type.half_length_m)
        mount, camera = reference_camera(rig or self.rig, RigidTransform.from_yaw("world", "ego", point, yaw_rad))
        faces = [FaceInWorld.of(face, face.parent_from_surface) for face in self.faces]
        return self.limits.judge(self.space, faces, mount, camera)


def _between(ego: Spawn, truck: Spawn) -> Footprint:
    """The strip of road between the ego car and its truck."""
    dx, dy = truck.x_m - ego.x_m, truck.y_m - ego.y_m
    return Footprint(
        (ego.x_m + truck.x_m) / 2,
        (ego.y_m + truck.y_m) / 2,
        (ego.near_z_m + truck.near_z_m) / 2,
        float(np.arctan2(dy, dx)),
        float(np.hypot(dx, dy)) / 2,
        CORRIDOR_M,
    )
