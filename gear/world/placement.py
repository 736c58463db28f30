"""Geometric queries to the placement model: height of the ground, overlaps, lines of sight, and resting poses of
actors.

MuJoCo computes the answers. It uses rays for the ground and for lines of sight, its collision detection for overlaps,
and a short simulation from a reset state for actors on uneven ground.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array, RigidTransform
from gear.values.scene import Pose
from gear.world.assets.actor_types import ActorType
from gear.world.compilation.actor_pool import PARKED_DEPTH_M
from gear.world.compilation.model_compilation import ACTOR_GROUP, GROUND_GROUP, OBSTACLE_GROUP

EVEN_M = 0.005
"""Ground is even, and needs no simulation, if the four feet are at most this far from their common plane, metres."""

STEP_UP_M = 1.2
"""Height above the lane at which rays to the ground start, metres; low enough that the rays do not start above a bridge
over the lane.
"""

SETTLE_DROP_M = 0.01
SETTLE_STEP_S = 0.005
SETTLE_STEPS = 120
OVERLAP_M = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class GroundPose:
    """The pose of an actor on the ground.

    Attributes:
        world_from_actor: the pose.
        is_even: whether all four feet touch the ground at this pose.
    """

    world_from_actor: RigidTransform
    is_even: bool


def _groups(*wanted: int) -> npt.NDArray[np.uint8]:
    groups = np.zeros(6, np.uint8)
    groups[list(wanted)] = 1
    return groups


_GROUND = _groups(GROUND_GROUP)
_STATIC = _groups(GROUND_GROUP, OBSTACLE_GROUP)
_ACTORS = _groups(ACTOR_GROUP)


class PlacementSpace:
    """Answers geometric queries with the placement model of a world. Every query starts from the reset state, so
    results do not depend on earlier queries.
    """

    def __init__(
        self, model: mujoco.MjModel, bodies: Mapping[str, ActorType], parked_m: float = -PARKED_DEPTH_M
    ) -> None:
        """Prepares the placement model for queries. All actors are moved out of the way, and the time step and the
        integrator of `model` are changed.

        Args:
            model: the placement model.
            bodies: the assets of its actors, by body name.
            parked_m: height in metres at which actors are kept that do not take part in a query.
        """
        self._model = model
        self._parked_m = parked_m
        self._types = dict(bodies)
        self._qpos = {name: int(model.joint(name).qposadr[0]) for name in bodies}
        self._dof = {name: int(model.joint(name).dofadr[0]) for name in bodies}
        self._body_of_id = {int(model.body(name).id): name for name in bodies}
        self._data = mujoco.MjData(model)
        model.opt.timestep = SETTLE_STEP_S
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        self._pose({})

    def ground_m(self, x_m: float, y_m: float, near_z_m: float) -> float | None:
        """The height of the ground at one point, measured by a vertical ray.

        Args:
            x_m, y_m: the point, world coordinates.
            near_z_m: height near which the ground is searched: from `STEP_UP_M` above it to twice this distance below
                it.

        Returns:
            The height in world coordinates, metres; None if there is no ground near `near_z_m`.
        """
        start_m = np.array([x_m, y_m, near_z_m + STEP_UP_M])
        geom = np.zeros(1, np.int32)
        down = np.array([0.0, 0.0, -1.0])
        distance_m = mujoco.mj_ray(self._model, self._data, start_m, down, _GROUND, 1, -1, geom)
        if distance_m < 0 or distance_m > 3 * STEP_UP_M:
            return None
        return float(start_m[2] - distance_m)

    def ground_pose(
        self, actor_type: ActorType, x_m: float, y_m: float, near_z_m: float, yaw_rad: float
    ) -> GroundPose | None:
        """Computes the pose of an actor that stands on the ground.

        A person stands upright on the ground below the person's middle. A vehicle stands on the plane that fits the
        ground below its four feet best (least squares).

        Args:
            actor_type: asset of the actor.
            x_m, y_m: position in world coordinates.
            near_z_m: height near which the ground is searched.
            yaw_rad: heading, counter-clockwise from east.

        Returns:
            The pose; None if there is no ground below one of the feet.
        """
        if actor_type.is_person:
            z_m = self.ground_m(x_m, y_m, near_z_m)
            if z_m is None:
                return None
            return GroundPose(RigidTransform.from_yaw("world", "actor", (x_m, y_m, z_m), yaw_rad), True)
        placement_body = actor_type.placement_body
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        feet: list[tuple[float, float, float]] = []
        for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            ahead_m, left_m = sx * placement_body.half_length_m, sy * placement_body.half_width_m
            height_m = self.ground_m(x_m + c * ahead_m - s * left_m, y_m + s * ahead_m + c * left_m, near_z_m)
            if height_m is None:
                return None
            feet.append((ahead_m, left_m, height_m))
        points = np.array(feet)
        # The feet are symmetric about the origin, so the least-squares plane is three means.
        z_m = float(points[:, 2].mean())
        climb = float((points[:, 0] * points[:, 2]).sum() / (points[:, 0] ** 2).sum())
        bank = float((points[:, 1] * points[:, 2]).sum() / (points[:, 1] ** 2).sum())
        uneven_m = np.abs(z_m + climb * points[:, 0] + bank * points[:, 1] - points[:, 2]).max()
        forward = np.array([c, s, climb])
        forward /= np.linalg.norm(forward)
        left = np.array([-s, c, bank])
        left -= forward * (left @ forward)
        left /= np.linalg.norm(left)
        rotation = np.stack([forward, left, np.cross(forward, left)], axis=1)
        pose = RigidTransform.from_parts("world", "actor", rotation, (x_m, y_m, z_m))
        return GroundPose(pose, bool(uneven_m <= EVEN_M))

    def overlaps(self, poses: Mapping[str, RigidTransform]) -> list[tuple[str, str]]:
        """Finds actors that overlap each other, the town or a board.

        Args:
            poses: world pose of each actor, by name of its body; all other actors are out of the way.

        Returns:
            Sorted pairs of body names. The second name is "" if an actor overlaps the town or a board.
        """
        self._pose(poses)
        mujoco.mj_collision(self._model, self._data)
        # Arrays of all contacts: there are hundreds of them, mostly of feet on the ground.
        geoms = self._data.contact.geom[self._data.contact.dist <= -OVERLAP_M]
        group = self._model.geom_group[geoms]
        is_actor = group == ACTOR_GROUP
        is_body_contact = is_actor.any(axis=1) & (is_actor | (group == OBSTACLE_GROUP)).all(axis=1)
        bodies = self._model.body_rootid[self._model.geom_bodyid[geoms[is_body_contact]]]
        pairs: set[tuple[str, str]] = set()
        for pair in np.unique(bodies, axis=0).tolist():
            names = [self._body_of_id.get(body, "") for body in pair]
            if any(name in poses for name in names):
                first, second = sorted(names, reverse=True)
                pairs.add((first, second))
        return sorted(pairs)

    def settle(self, poses: Mapping[str, RigidTransform]) -> dict[str, RigidTransform]:
        """Drops actors from just above the given poses and simulates until they come to rest on uneven ground.

        Args:
            poses: world pose of each actor, by name of its body.

        Returns:
            The pose after the simulation, by the same names.
        """
        lifted = {
            name: RigidTransform.from_parts(
                "world", "actor", pose.rotation, pose.translation_m + pose.rotation[:, 2] * SETTLE_DROP_M
            )
            for name, pose in poses.items()
        }
        self._pose(lifted)
        for _ in range(SETTLE_STEPS):
            mujoco.mj_step(self._model, self._data)
        settled = {}
        for name in poses:
            body = self._model.body(name).id
            settled[name] = RigidTransform.from_parts(
                "world", "actor", self._data.xmat[body].reshape(3, 3), self._data.xpos[body]
            )
        self._pose({})
        return settled

    def visible(self, eye_m: Array, targets_m: Array) -> npt.NDArray[np.bool_]:
        """Tests which points are visible from one point. Only the town, its boards and its ground can hide a
        point; actors cannot.

        Args:
            eye_m: (3,) position of the camera, world coordinates.
            targets_m: (N, 3) points, world coordinates; none equals `eye_m`.

        Returns:
            (N,) bool.
        """
        return self._rays(eye_m, targets_m, _STATIC)[0] < 0

    def occluders(self, eye_m: Array, targets_m: Array, poses: Mapping[str, RigidTransform]) -> list[str | None]:
        """The names of the actors' bodies that hide points from `eye_m`, (3,): one name for each of (N, 3) points; None
        for a point that no actor hides.

        Args:
            eye_m: (3,) position of the camera in world coordinates.
            targets_m: (N, 3) points in world coordinates.
            poses: world pose of each actor, by name of its body.
        """
        self._pose(poses)
        geoms = self._rays(eye_m, targets_m, _ACTORS)[0]
        roots = [int(self._model.body_rootid[self._model.geom_bodyid[g]]) if g >= 0 else -1 for g in geoms]
        return [self._body_of_id.get(root) for root in roots]

    def _rays(
        self, eye_m: Array, targets_m: Array, groups: npt.NDArray[np.uint8]
    ) -> tuple[npt.NDArray[np.int32], Array]:
        """Casts rays to (N, 3) targets.

        Returns:
            (N,) id of the geom that each ray hits before its target, -1 for none, and (N,) distances.
        """
        rays = np.ascontiguousarray(targets_m - eye_m, dtype=np.float64)
        reach_m = np.linalg.norm(rays, axis=1)
        count = len(rays)
        geoms, distances_m = np.full(count, -1, np.int32), np.full(count, -1.0)
        unit = np.ascontiguousarray(rays / reach_m[:, None])
        start_m = np.ascontiguousarray(eye_m, dtype=np.float64)
        mujoco.mj_multiRay(
            self._model, self._data, start_m, unit.reshape(-1), groups, 1, -1, geoms, distances_m, None, count,
            float(reach_m.max()),
        )  # fmt: skip
        geoms[(distances_m < 0) | (distances_m >= reach_m)] = -1
        return geoms, distances_m

    def _pose(self, poses: Mapping[str, RigidTransform]) -> None:
        """Resets the state, moves the named actors to their poses, and all other actors far below the town,
        apart from each other.
        """
        mujoco.mj_resetData(self._model, self._data)
        for number, (name, address) in enumerate(self._qpos.items()):
            if name in poses:
                pose = Pose.from_transform(poses[name])
                self._data.qpos[address : address + 7] = (*pose.position_m, *pose.quat_wxyz)
            else:
                self._data.qpos[address : address + 7] = (30.0 * number, 0.0, self._parked_m, 1.0, 0.0, 0.0, 0.0)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
