"""Frames without a renderer: boxes on a plane, drawn by exact ray casting.

Every pixel of colour, depth and ids is known in closed form, so that a task can be held against geometry instead of
against a renderer. Texture is painted on the things themselves, so that two cameras see the same marks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.values.frames import LINEAR_FULL_SCALE, Frame, GeomTable, SceneObject, Shape, View
from gear.values.geometry import Array, RigidTransform
from gear.values.labels import LABEL_BY_NAME, LABELS
from gear.values.rig import Rig
from gear.values.rng import derive_rng
from gear.values.scene import ActorRecord, CameraRecord, Pose, SceneRecord, SurfaceRecord, Vec3, Weather

GROUND_GEOM = 0
CELL_M = 0.4
"""Side of the painted squares."""

UNIT_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]],
    dtype=np.int32,
)  # fmt: skip
"""Triangles of a box whose corner i has the signs of i's bits: 4 is x, 2 is y, 1 is z."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One box of a thing, in the thing's frame.

    Attributes:
        label: name of a gear label.
        centre_m, size_m: middle, and length (x), width (y), height (z).
        surface: number of the surface whose face this box is, or -1.
    """

    label: str
    centre_m: Vec3
    size_m: Vec3
    surface: int = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """Boxes that move together.

    Attributes:
        parts: its boxes; the first says what it mainly is.
        position_m, yaw_rad: where its frame stands in the world.
        object_id: as in `GeomTable.object_id`; -1 for what cannot be counted.
        role: of the actor, or None for a thing of the town.
    """

    parts: tuple[Part, ...]
    position_m: Vec3
    yaw_rad: float = 0.0
    object_id: int = -1
    role: str | None = None

    @property
    def world_from_thing(self) -> RigidTransform:
        """Its pose."""
        return RigidTransform.from_yaw("world", "object", self.position_m, self.yaw_rad)


def box_part(label: str, length_m: float, width_m: float, height_m: float) -> Part:
    """A box that stands on the ground in the middle of its frame."""
    return Part(label=label, centre_m=(0.0, 0.0, height_m / 2), size_m=(length_m, width_m, height_m))


CAR = (box_part("car", 4.2, 1.8, 1.5),)
VAN = (box_part("van", 5.0, 2.0, 2.2),)
TRUCK = (box_part("truck", 8.0, 2.5, 3.5),)
PERSON = (box_part("person", 0.5, 0.6, 1.75),)
CYCLIST = (
    box_part("bicycle", 1.8, 0.4, 1.0),
    Part(label="rider", centre_m=(0.0, 0.0, 1.4), size_m=(0.5, 0.5, 0.8)),
)
TRAFFIC_LIGHT = (Part(label="traffic_light", centre_m=(0.0, 0.0, 4.0), size_m=(0.4, 0.4, 1.2)),)

SLOTS = (
    (CAR, 9.5, -2.6),
    (CYCLIST, 9.0, 1.0),
    (PERSON, 11.0, -5.2),
    (CAR, 15.0, 3.4),
    (PERSON, 16.0, 5.8),
    (VAN, 20.0, 3.2),
    (TRUCK, 24.0, -2.8),
    (CAR, 30.0, 0.4),
    (CAR, 37.0, -1.0),
    (PERSON, 42.0, 7.5),
)
"""What stands in `street`: what, how far ahead and how far to the left in metres; far enough apart never to overlap."""


def board(distance_m: float, left_m: float = 0.0, *, surface: int = 0, bottom_m: float = 0.15) -> Thing:
    """A billboard ahead of an ego car at the origin, facing it: a 7.4 m x 3.7 m face on a thicker board."""
    middle = bottom_m + 1.85
    face = Part(label="billboard", centre_m=(0.005, 0.0, middle), size_m=(0.01, 7.4, 3.7), surface=surface)
    back = Part(label="billboard", centre_m=(0.16, 0.0, middle), size_m=(0.3, 7.8, 4.1))
    return Thing(parts=(back, face), position_m=(distance_m, left_m, 0.0))


def street(seed: int = 0, index: int = 0) -> tuple[Thing, ...]:
    """A street ahead of the origin: a board, cars, a van, a truck, people, a cyclist, a traffic light; drawn from the
    seed."""
    rng = derive_rng(seed, "synthetic", index)
    things = [
        board(24.0, 6.0),
        Thing(parts=(box_part("building", 2.0, 60.0, 14.0),), position_m=(60.0, 0.0, 0.0)),
        Thing(parts=(box_part("pole", 0.12, 0.12, 5.0),), position_m=(12.0, -5.5, 0.0)),
        Thing(parts=(box_part("vegetation", 3.0, 3.0, 5.0),), position_m=(30.0, -12.0, 0.0)),
        Thing(parts=TRAFFIC_LIGHT, position_m=(18.0, -6.0, 0.0), object_id=1000),
    ]
    for number, (parts, ahead_m, left_m) in enumerate(SLOTS):
        position = (ahead_m + rng.uniform(-0.4, 0.4), left_m + rng.uniform(-0.4, 0.4), 0.0)
        role = "pedestrian" if parts is PERSON else "npc"
        yaw = float(rng.normal(0.0, 0.15)) + math.pi * int(rng.integers(2))
        things.append(Thing(parts=parts, position_m=position, yaw_rad=yaw, object_id=number + 2, role=role))
    return tuple(things)


def synthetic_frame(
    rig: Rig,
    things: Sequence[Thing] | None = None,
    *,
    index: int = 0,
    seed: int = 0,
    world_from_ego: RigidTransform | None = None,
) -> tuple[Frame, SceneRecord]:
    """Renders things on a road seen from an ego car, and the record that belongs to them.

    Args:
        rig: the cameras.
        things: what stands there, in the ego car's frame (x forward, y left); `street(seed, index)` by default.
        index, seed: of the record.
        world_from_ego: where the ego car stands; the origin by default. Everything moves along.

    Returns:
        The frame, whose views are exact, and its record.
    """
    world_from_ego = world_from_ego or RigidTransform.from_yaw("world", "ego", (0.0, 0.0, 0.0), 0.0)
    placed = tuple(_moved(thing, world_from_ego) for thing in (street(seed, index) if things is None else things))
    boxes = [(thing, part) for thing in placed for part in thing.parts]
    cameras = rig.place(world_from_ego)
    codes = [LABEL_BY_NAME["road"].code, *(LABEL_BY_NAME[part.label].code for _, part in boxes)]
    geoms = GeomTable(
        label_code=np.array(codes, dtype=np.uint8),
        object_id=np.array([-1, *(thing.object_id for thing, _ in boxes)], dtype=np.int32),
        surface_index=np.array([-1, *(part.surface for _, part in boxes)], dtype=np.int16),
    )
    views = {camera.name: _render(camera, boxes, geoms) for camera in cameras}
    objects = {thing.object_id: _scene_object(thing) for thing in placed if thing.object_id >= 0}
    record = _record(placed, cameras, world_from_ego, index=index, seed=seed)
    return Frame(views=views, geoms=geoms, objects=objects), record


def _moved(thing: Thing, world_from_ego: RigidTransform) -> Thing:
    position = world_from_ego.apply(thing.position_m)
    return Thing(
        parts=thing.parts,
        position_m=(float(position[0]), float(position[1]), float(position[2])),
        yaw_rad=thing.yaw_rad + world_from_ego.yaw_rad,
        object_id=thing.object_id,
        role=thing.role,
    )


def _corners(part: Part) -> Array:
    signs = np.array([[(i >> 2 & 1) - 0.5, (i >> 1 & 1) - 0.5, (i & 1) - 0.5] for i in range(8)])
    return np.asarray(signs * part.size_m + part.centre_m)


def _scene_object(thing: Thing) -> SceneObject:
    vertices = np.concatenate([_corners(part) for part in thing.parts])
    faces = np.concatenate([UNIT_FACES + 8 * i for i in range(len(thing.parts))])
    codes = [LABEL_BY_NAME[part.label].code for part in thing.parts]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    main = LABELS[codes[0]]
    return SceneObject(
        id=thing.object_id,
        asset=f"synthetic_{main.name}",
        label_code=main.code,
        kitti_type=main.kitti_type,
        is_ego=thing.role == "ego",
        world_from_object=thing.world_from_thing,
        shape=Shape(
            vertices_m=vertices,
            faces=faces.astype(np.int32),
            face_label_code=np.repeat(np.array(codes, dtype=np.uint8), len(UNIT_FACES)),
            box_centre_m=(low + high) / 2,
            box_size_m=high - low,
        ),
    )


def _render(camera: CameraRecord, boxes: Sequence[tuple[Thing, Part]], geoms: GeomTable) -> View:
    """Nearest hit of each pixel's ray with the ground plane and every box."""
    height, width = camera.height_px, camera.width_px
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    world_from_camera = camera.world_from_camera_transform
    directions = camera.intrinsics.unproject(np.stack([u, v], axis=-1), np.ones((height, width)))
    rays = directions @ world_from_camera.rotation.T
    origin = world_from_camera.translation_m
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = -origin[2] / rays[..., 2]
    depth = np.where((depth > 0) & (depth < 1000), depth, np.inf)
    ids = np.where(np.isfinite(depth), GROUND_GEOM, -1).astype(np.int32)
    for number, (thing, part) in enumerate(boxes, start=1):
        nearest = _enter(origin, rays, thing, part)
        closer = nearest < depth
        depth[closer], ids[closer] = nearest[closer], number
    points = origin + np.where(np.isfinite(depth), depth, 0.0)[..., None] * rays
    rgb = _paint(points, ids, geoms)
    linear = np.round((rgb / 255.0) ** 2.2 * LINEAR_FULL_SCALE).astype(np.uint16)
    depth_m = np.where(np.isfinite(depth), depth, np.nan).astype(np.float32)
    return View(camera=camera, linear_rgb=linear, rgb=rgb, depth_m=depth_m, geom_id=ids)


def _enter(origin: Array, rays: Array, thing: Thing, part: Part) -> Array:
    """Depth at which each ray enters the box, infinite where it misses it. Rays have unit depth a step."""
    thing_from_world = thing.world_from_thing.inverse()
    start = thing_from_world.apply(origin) - part.centre_m
    along = rays @ thing_from_world.rotation.T
    half = np.array(part.size_m) / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (-half - start) / along, (half - start) / along
    enter = np.fmin(one, two).max(axis=-1)
    leave = np.fmax(one, two).min(axis=-1)
    return np.where((enter < leave) & (enter > 0), enter, np.inf)


def _paint(points: Array, ids: npt.NDArray[np.int32], geoms: GeomTable) -> npt.NDArray[np.uint8]:
    """A colour for each geom, in two shades by squares of the world; the sky is a gradient."""
    square = (np.floor(points / CELL_M).astype(np.int64).sum(axis=-1) % 2)[..., None]
    number = ids.astype(np.int64)[..., None]
    code = geoms.label_code[ids].astype(np.int64)[..., None]
    colour = (number * (37, 59, 83) + code * (71, 29, 53)) % 156 + 40
    rgb = np.where(square == 1, colour, colour + 50)
    sky = np.linspace(220, 160, ids.shape[0])[:, None, None] * (0.8, 0.9, 1.0)
    return np.where(number < 0, sky, rgb).astype(np.uint8)


def _record(
    things: Sequence[Thing], cameras: tuple[CameraRecord, ...], world_from_ego: RigidTransform, *, index: int, seed: int
) -> SceneRecord:
    actors = [
        ActorRecord(id=1, asset="synthetic_ego", role="ego", world_from_actor=Pose.from_transform(world_from_ego))
    ]
    surfaces = []
    for thing in things:
        pose = Pose.from_transform(thing.world_from_thing)
        if thing.role in ("npc", "parked", "pedestrian", "carrier"):
            asset = f"synthetic_{thing.parts[0].label}"
            actors.append(ActorRecord(id=thing.object_id, asset=asset, role=thing.role, world_from_actor=pose))  # type: ignore[arg-type]
        surfaces += [_surface(thing, part) for part in thing.parts if part.surface >= 0]
    return SceneRecord(
        town="synthetic",
        scene="street",
        split="test",
        seed=seed,
        index=index,
        sequence=index,
        frame=0,
        time_s=0.0,
        weather=Weather(name="ClearNoon"),
        actors=tuple(actors),
        surfaces=tuple(sorted(surfaces, key=lambda surface: surface.name)),
        cameras=cameras,
    )


def _surface(thing: Thing, part: Part) -> SurfaceRecord:
    """The face is the side of the part that looks along -x of the thing; right is -y, down is -z, into the board is
    +x."""
    x, y, z = part.centre_m
    rotation = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]
    thing_from_surface = RigidTransform.from_parts("object", "surface", rotation, (x - part.size_m[0] / 2, y, z))
    rides = thing.role == "carrier"
    parent_from_surface = thing_from_surface if rides else thing.world_from_thing @ thing_from_surface
    return SurfaceRecord(
        name=f"surface_{part.surface}",
        asset="synthetic_board",
        actor_id=thing.object_id if rides else None,
        parent_from_surface=Pose.from_transform(parent_from_surface),
        width_m=part.size_m[1],
        height_m=part.size_m[2],
    )
