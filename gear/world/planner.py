"""Plans the samples of a split. Each sample depends only on the world, the split's seed and the sample's index."""

from __future__ import annotations

from collections.abc import Sequence

from gear.config.collection import SplitConfig
from gear.values.errors import PlacementError
from gear.values.frames import STATIC_OBJECT_BASE
from gear.values.geometry import RigidTransform
from gear.values.rig import Rig
from gear.values.scene import POSE_DIGITS, ActorRecord, Pose, SceneRecord, Vec3
from gear.world.assets.scene_assets import EGO_ASSET
from gear.world.camera_position import check_outside
from gear.world.placement import PlacementSpace
from gear.world.surfaces.view_limits import reference_camera
from gear.world.traffic.crowd import Crowd, OcclusionTest, RoadUsers
from gear.world.traffic.ego_sampling import EgoSampler
from gear.world.traffic.sequence import FrameState, SequenceSimulator
from gear.world.traffic.spawn import Spawn, Spawner
from gear.world.world import World

SEQUENCES_CACHED = 4
"""Number of planned sequences in the cache. A few are enough, because frames are usually requested in order."""


class ScenePlanner:
    """Plans the samples of one split. Each sample becomes a scene record: all actors with their poses, drawn from the
    split's seed, and the cameras.
    """

    def __init__(self, world: World, rig: Rig, split: SplitConfig, *, split_name: str) -> None:
        """Prepares the data that all samples of the split share.

        Args:
            world: compiled world; the planner uses its placement model.
            rig: cameras on the ego car. The first camera is the reference camera, to which the boards must be visible.
            split: seed, and length of the sequences.
            split_name: name of the split in records. Random draws do not depend on it, so `test_night` has the same
                scenes as `test`.

        Raises:
            PlacementError: a camera is inside the ego car.
        """
        check_outside(rig, world.types[EGO_ASSET].shape, world.scene_name)
        self._world = world
        self._rig = rig
        self._split = split
        self._split_name = split_name
        bodies = {slot.body: world.types[slot.actor.name] for slot in world.slots}
        space = PlacementSpace(world.placement_model, bodies, world.parked_m)
        spawner = Spawner(world.lanes)
        self._ego_sampler = EgoSampler(
            scene_name=world.scene_name,
            scene=world.scene,
            rig=rig,
            types=world.types,
            slots=world.slots,
            faces=world.faces,
            spawner=spawner,
            space=space,
        )
        self._simulator = SequenceSimulator(world.scene_name, world.lanes, space)
        self._cached: dict[int, Sequence[FrameState]] = {}
        self._crowd = Crowd(
            scene_name=world.scene_name, scene=world.scene, types=world.types, spawner=spawner, space=space
        )

    def plan(self, index: int) -> SceneRecord:
        """Plans one sample and returns its scene record.

        Args:
            index: number of the sample, counted over all frames of the split.

        Raises:
            PlacementError: the limits of the scene are too tight; the message names the limit.
        """
        sequence, frame = divmod(index, self._split.frames)
        state = self._frames_of(sequence)[frame]
        return self._record(state, index, sequence, frame)

    def _frames_of(self, sequence: int) -> Sequence[FrameState]:
        """All frames of a sequence; the sequences that were planned last are kept."""
        if sequence not in self._cached:
            self._cached[sequence] = self._sample(sequence)
            if len(self._cached) > SEQUENCES_CACHED:
                self._cached.pop(next(iter(self._cached)))
        return self._cached[sequence]

    def _sample(self, sequence: int) -> Sequence[FrameState]:
        split = self._split
        duration_s = split.frames * split.interval_s if split.frames > 1 else 0.0
        road_users = self._ego_sampler.draw(split.seed, sequence, duration_s)
        self._crowd.fill(road_users, split.seed, sequence, self._occlusion_test(road_users))
        if split.frames == 1:
            return [FrameState(spawns=road_users.spawns, poses=road_users.poses)]
        return self._simulator.drive(road_users, split.seed, sequence, split.frames, split.interval_s)

    def _occlusion_test(self, road_users: RoadUsers) -> OcclusionTest | None:
        if not self._ego_sampler.faces:
            return None
        ego = next(iter(road_users.poses.values()))
        _, camera = reference_camera(self._rig, RigidTransform("world", "ego", ego.matrix))
        grids_m = tuple(face.grid_m for face in self._ego_sampler.faces_in_world(road_users))
        return OcclusionTest(
            camera.world_from_camera_transform.translation_m, grids_m, self._ego_sampler.limits.min_free
        )

    def _record(self, state: FrameState, index: int, sequence: int, frame: int) -> SceneRecord:
        world = self._world
        if len(state.spawns) >= STATIC_OBJECT_BASE:
            most = STATIC_OBJECT_BASE - 1
            raise PlacementError(world.scene_name, f"{len(state.spawns)} road users, {most} at most; lower the counts")
        actors = tuple(
            actor_record(number, spawn, state.poses[body])
            for number, (body, spawn) in enumerate(state.spawns.items(), start=1)
        )
        carrier = next((actor.id for actor in actors if actor.role == "carrier"), None)
        return SceneRecord(
            town=world.town_name,
            scene=world.scene_name,
            split=self._split_name,
            seed=self._split.seed,
            index=index,
            sequence=sequence,
            frame=frame,
            time_s=round(frame * self._split.interval_s, 9),
            weather=world.weather,
            actors=actors,
            surfaces=world.surface_records(carrier),
            cameras=self._rig.place(actors[0].world_from_actor.transform("world", "ego")),
        )


def actor_record(number: int, spawn: Spawn, world_from_actor: RigidTransform) -> ActorRecord:
    """The record of a road user with the id `number`, at its pose on the ground.

    Args:
        number: id of the road user.
        spawn: asset, colour and role of the road user.
        world_from_actor: pose on the ground.
    """
    velocity = world_from_actor.rotation[:, 0] * spawn.speed_mps
    rounded = [round(float(v), POSE_DIGITS) + 0.0 for v in velocity]
    velocity_mps: Vec3 = (rounded[0], rounded[1], rounded[2])
    return ActorRecord(
        id=number,
        asset=spawn.actor_type.facts.name,
        role=spawn.role,
        world_from_actor=Pose.from_transform(world_from_actor),
        velocity_world_mps=velocity_mps,
        paint_rgb=spawn.paint_rgb,
    )
