"""Rendered frames without a renderer: boxes on a plane, drawn by exact ray casting.

Colour, depth and ids of every pixel are known in closed form, so tests compare tasks with geometry instead of a
renderer. Textures are fixed to world positions, so two cameras see the same marks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gear.camera.effects.lens import Lens, LensDistortion, distort, lens_map
from gear.contracts.rendering import RawView
from gear.testing.things import Part, Thing, street
from gear.values.frames import LINEAR_FULL_SCALE, Frame, GeomTable, SceneObject, Shape, View
from gear.values.geometry import Array, RigidTransform
from gear.values.labels import LABEL_BY_NAME, LABELS
from gear.values.rig import Rig
from gear.values.scene import ActorRecord, CameraRecord, Pose, SceneRecord, SurfaceRecord, Weather

GROUND_GEOM = 0
CELL_M = 0.4
"""Side of the squares painted on all geoms."""

UNIT_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]],
    dtype=np.int32,
)  # fmt: skip
"""The 12 triangles of a box, as corner numbers 0..7: in a number, bit 4 is the sign of x, bit 2 of y, bit 1 of z."""


def synthetic_frame(
    rig: Rig,
    things: Sequence[Thing] | None = None,
    *,
    index: int = 0,
    seed: int = 0,
    world_from_ego: RigidTransform | None = None,
) -> tuple[Frame, SceneRecord]:
    """Renders boxes on a road as the cameras of an ego car see them.

    Args:
        rig: the cameras.
        things: objects in the ego car's frame (x forward, y left); `street(seed, index)` by default.
        index: sample index in the record.
        seed: seed in the record.
        world_from_ego: pose of the ego car; the origin by default. All objects move with it.

    Returns:
        The frame with exact views, and its record.
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


def behind_lens(frame: Frame, lens: Lens) -> Frame:
    """Distorts a frame of pinhole cameras by a lens; the lens is added to the cameras of the result.

    Args:
        frame: the frame; it is not changed.
        lens: radial distortion of the lens.

    Raises:
        ValueError: the distortion folds a picture over.
    """
    views = {}
    for name, view in frame.views.items():
        found = lens_map(lens, view.camera.intrinsics)
        raw = RawView(linear_rgb=view.linear_rgb, depth_m=view.depth_m, geom_id=view.geom_id)
        seen = distort(raw, lens, view.camera.intrinsics)
        assert seen.linear_rgb is not None
        views[name] = View(
            camera=LensDistortion(lens=lens).recorded(view.camera),
            linear_rgb=seen.linear_rgb,
            rgb=view.rgb[np.rint(found.y).astype(np.intp), np.rint(found.x).astype(np.intp)],
            depth_m=seen.depth_m,
            geom_id=seen.geom_id,
        )
    return replace(frame, views=views)


def _moved(thing: Thing, world_from_ego: RigidTransform) -> Thing:
    position = world_from_ego.apply(thing.position_m)
    return Thing(
        parts=thing.parts,
        position_m=(float(position[0]), float(position[1]), float(position[2])),
        yaw_rad=thing.yaw_rad + world_from_ego.yaw_rad,
        object_id=thing.object_id,
        role=thing.role,
        key_points=thing.key_points,
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
        key_points=dict(thing.key_points),
    )


def _render(camera: CameraRecord, boxes: Sequence[tuple[Thing, Part]], geoms: GeomTable) -> View:
    """The view of a camera: for each pixel, the nearest hit of its ray with the ground plane and every box."""
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
        window = _window(camera, thing, part)
        nearest = _enter(origin, rays[window], thing, part)
        closer = nearest < depth[window]
        depth[window][closer], ids[window][closer] = nearest[closer], number
    points = origin + np.where(np.isfinite(depth), depth, 0.0)[..., None] * rays
    rgb = _paint(points, ids, geoms)
    linear = np.round((rgb / 255.0) ** 2.2 * LINEAR_FULL_SCALE).astype(np.uint16)
    depth_m = np.where(np.isfinite(depth), depth, np.nan).astype(np.float32)
    return View(camera=camera, linear_rgb=linear, rgb=rgb, depth_m=depth_m, geom_id=ids)


def _window(camera: CameraRecord, thing: Thing, part: Part) -> tuple[slice, slice]:
    """The rows and columns of the pixels whose rays can meet the box."""
    camera_from_world = camera.world_from_camera_transform.inverse()
    corners = camera_from_world.apply(thing.world_from_thing.apply(_corners(part)))
    if corners[:, 2].min() < 0.01:
        return slice(None), slice(None)
    pixels = camera.intrinsics.project(corners)
    (left, top), (right, bottom) = np.floor(pixels.min(axis=0)) - 1, np.ceil(pixels.max(axis=0)) + 2
    return slice(max(0, int(top)), max(0, int(bottom))), slice(max(0, int(left)), max(0, int(right)))


def _enter(origin: Array, rays: Array, thing: Thing, part: Part) -> Array:
    """The depth at which each ray enters the box; infinite for a miss. Rays have depth 1 per unit of length."""
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
    """The (H, W, 3) uint8 colours of hit points: one colour per geom in two shades by squares; a gradient for the
    sky.
    """
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
            actors.append(ActorRecord(id=thing.object_id, asset=asset, role=thing.role, world_from_actor=pose))
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
    """The record of a patch surface: the side of the part that faces -x of the object.

    In the surface's frame, right is -y of the object, down is -z, into the board is +x.
    """
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
