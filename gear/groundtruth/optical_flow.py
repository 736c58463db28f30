"""Optical flow from one frame of a driving sequence to the next: exact, from depth, camera poses and objects'
poses.

Every body in gear's worlds is rigid, people who walk included. The flow of a pixel therefore follows from the point
that the pixel shows: this point moves with its object, and the next camera sees it at another position. The sky is
infinitely far away, so only the camera's rotation moves it. Shadows, reflections and rain are not points of a surface
and have no flow of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.camera.effects import recorded_effects
from gear.values.frames import FloatImage, IdImage, UInt16Image
from gear.values.geometry import Array, Intrinsics
from gear.values.scene import ActorRecord, CameraRecord, SceneRecord

DEPTH_TOLERANCE = 0.005
"""Largest relative difference of the depth of a point and of the surface that the next frame shows at its place, for
the point to be visible there. The local plane through the point is taken into account.
"""

_NEAR_M = 1e-6

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class FlowView:
    """What one camera sees in one frame, as a pinhole camera without its lens.

    Attributes:
        camera: the camera with its pose.
        depth_m: (H, W) float32 planar depth, NaN where no surface was hit.
        object_id: (H, W) int32 id of the actor at each pixel; -1 or an id that no actor has for everything that stands
            still.
    """

    camera: CameraRecord
    depth_m: FloatImage
    object_id: IdImage


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Flow:
    """The optical flow of one picture.

    Attributes:
        flow_px: (H, W, 2) float32 motion of each pixel to the right and downwards, in pixels; NaN where the point is
            behind the next camera, or where its object does not exist in the next frame.
        is_visible: (H, W) bool, whether the next picture shows the point: it is inside the picture, and nothing is in
            front of it. Points at edges whose visibility is not certain count as hidden.
        actor_id: (H, W) uint16 id of the road user that a pixel shows; 0 for everything else and for the ego car.
    """

    flow_px: FloatImage
    is_visible: Mask
    actor_id: UInt16Image


def object_ids(geom_id: IdImage, id_of_geom: npt.NDArray[np.int32]) -> IdImage:
    """(H, W) int32 object ids of a picture from its geom ids; -1 where no geom was hit.

    Args:
        geom_id: (H, W) geom ids; -1 where no geom was hit.
        id_of_geom: (ngeom,) object id of each geom.
    """
    return np.where(geom_id >= 0, id_of_geom[geom_id], np.int32(-1)).astype(np.int32)


def optical_flow(now: FlowView, after: FlowView, record: SceneRecord, next_record: SceneRecord) -> Flow:
    """Computes the flow from one frame to the next, in the picture that the camera takes through its lens.

    Args:
        now, after: views of the same camera in the two frames.
        record, next_record: the scenes of the two frames; actors have the same ids in both.
    """
    pinhole = now.camera.intrinsics
    pixels = _pixel_grid(pinhole)
    moved_m = _moved_points(now, after.camera, _motions(record, next_record), pixels)
    depth_m = moved_m[..., 2]
    is_sky = ~np.isfinite(now.depth_m)
    with np.errstate(invalid="ignore", divide="ignore"):
        ends = np.where((depth_m > _NEAR_M)[..., None], after.camera.intrinsics.project(moved_m), np.nan)
        inverse_depth = np.where(is_sky, 0.0, 1 / depth_m)
    is_shown = _is_shown(now, after, ends, inverse_depth)
    others = [actor.id for actor in record.actors if actor.role != "ego"]
    actor_id = np.where(np.isin(now.object_id, others), now.object_id, 0).astype(np.uint16)
    whole = Flow(flow_px=(ends - pixels).astype(np.float32), is_visible=is_shown, actor_id=actor_id)
    return _through_lens(whole, now.camera, after.camera, pixels)


def _pixel_grid(pinhole: Intrinsics) -> Array:
    """(H, W, 2) positions (x, y) of the pixels, index pixels."""
    columns, rows = np.meshgrid(np.arange(pinhole.width_px), np.arange(pinhole.height_px))
    return np.stack([columns, rows], axis=-1).astype(np.float64)


def _motions(record: SceneRecord, next_record: SceneRecord) -> Mapping[int, Array | None]:
    """(4, 4) motion of each actor in the world between two frames, by id; None for actors without a next pose."""
    later: dict[int, ActorRecord] = {actor.id: actor for actor in next_record.actors}
    motions: dict[int, Array | None] = {}
    for actor in record.actors:
        if actor.id not in later:
            motions[actor.id] = None
            continue
        before = actor.world_from_actor.transform("world", "actor")
        after = later[actor.id].world_from_actor.transform("world", "actor")
        motions[actor.id] = after.matrix @ before.inverse().matrix
    return motions


def _moved_points(now: FlowView, camera: CameraRecord, motions: Mapping[int, Array | None], pixels: Array) -> Array:
    """(H, W, 3) the points that the pixels of `now` show, in the frame of the next camera after their motion, metres.

    For the sky they are directions; for actors without a next pose NaN.
    """
    depth_m = now.depth_m.astype(np.float64)
    is_sky = ~np.isfinite(depth_m)
    points_m = now.camera.intrinsics.unproject(pixels, np.where(is_sky, 1.0, depth_m))
    world_from_now = now.camera.world_from_camera_transform.matrix
    next_from_world = camera.world_from_camera_transform.inverse().matrix
    still = next_from_world @ world_from_now
    moved = points_m @ still[:3, :3].T
    moved[~is_sky] += still[:3, 3]
    for number in np.unique(now.object_id[~is_sky]):
        motion = motions.get(int(number), np.eye(4))
        is_actor = (now.object_id == number) & ~is_sky
        if motion is None:
            moved[is_actor] = np.nan
        elif int(number) in motions:
            matrix = next_from_world @ motion @ world_from_now
            moved[is_actor] = points_m[is_actor] @ matrix[:3, :3].T + matrix[:3, 3]
    return np.asarray(moved)


def _is_shown(now: FlowView, after: FlowView, ends: Array, inverse_depth: Array) -> Mask:
    """(H, W) bool, whether the next pinhole picture shows the points at their ends.

    Inverse depth is linear in the picture's coordinates on any plane. So the inverse depth that the point's surface has
    at the middles of the pixels around its end follows from the ends of the neighbouring pixels. The next frame must
    have this inverse depth and the same object at the nearest pixel, and nothing nearer at the four pixels around.
    """
    height, width = after.depth_m.shape
    size = np.array([width, height])
    found = np.nan_to_num(1 / after.depth_m.astype(np.float64), nan=0.0)
    is_finite: Mask = np.asarray(np.isfinite(ends).all(axis=-1))
    places = np.round(np.where(is_finite[..., None], ends, -9.0).clip(-9, size + 9), 6)
    nearest = np.rint(places)
    is_shown: Mask = is_finite & np.asarray(((nearest >= 0) & (nearest < size)).all(axis=-1))
    with np.errstate(invalid="ignore", divide="ignore"):
        slope_x, slope_y = _plane(now, ends, inverse_depth)
        slope_x, slope_y = (np.where(np.isfinite(now.depth_m), slope, 0.0) for slope in (slope_x, slope_y))
        ways = ((np.rint, np.rint), (np.floor, np.floor), (np.ceil, np.floor), (np.floor, np.ceil), (np.ceil, np.ceil))
        for number, way in enumerate(ways):
            column, row = (way[axis](places[..., axis]).clip(0, size[axis] - 1).astype(np.intp) for axis in (0, 1))
            expected = inverse_depth + slope_x * (column - places[..., 0]) + slope_y * (row - places[..., 1])
            nearer = found[row, column] - expected
            if number == 0:
                is_shown &= (np.abs(nearer) <= DEPTH_TOLERANCE * expected) | ~np.isfinite(now.depth_m)
                is_shown &= after.object_id[row, column] == now.object_id
            is_shown &= nearer <= DEPTH_TOLERANCE * expected
    return is_shown


def _plane(now: FlowView, ends: Array, inverse_depth: Array) -> tuple[Array, Array]:
    """(H, W) slopes of a surface's inverse depth in the next picture, to the right and downwards, from the ends of
    neighbouring pixels.

    Of the two neighbours in a row, and of those in a column, the one whose inverse depth is nearest is taken, because
    the other may belong to another surface. NaN if both belong to other objects.
    """
    steps = []
    for axis in (1, 0):
        forward = _difference(now.object_id, ends, inverse_depth, axis)
        flipped = np.flip(ends, axis), np.flip(inverse_depth, axis)
        backward = -np.flip(_difference(np.flip(now.object_id, axis), *flipped, axis), axis)
        sizes = [np.nan_to_num(np.abs(step[..., 2]), nan=np.inf) for step in (forward, backward)]
        steps.append(np.where((sizes[0] <= sizes[1])[..., None], forward, backward))
    (ax, ay, aw), (bx, by, bw) = (np.moveaxis(step, -1, 0) for step in steps)
    determinant = ax * by - ay * bx
    return (aw * by - ay * bw) / determinant, (ax * bw - aw * bx) / determinant


def _difference(object_id: IdImage, ends: Array, inverse_depth: Array, axis: int) -> Array:
    """(H, W, 3) differences of end x, end y and inverse depth from each pixel to the next along an axis; NaN at the
    border and where the next pixel shows another object.
    """
    values = np.concatenate([ends, inverse_depth[..., None]], axis=-1)
    step = np.full(values.shape, np.nan)
    here = np.s_[:, :-1] if axis == 1 else np.s_[:-1]
    there = np.s_[:, 1:] if axis == 1 else np.s_[1:]
    step[here] = np.where((object_id[here] == object_id[there])[..., None], values[there] - values[here], np.nan)
    return step


def _through_lens(flow: Flow, camera: CameraRecord, next_camera: CameraRecord, pixels: Array) -> Flow:
    """The flow of the picture that a lens makes of the pinhole's picture; without a lens it stays as it is.

    A pixel behind a lens has the depth of the nearest pixel of the pinhole's picture. Its flow is that of the point at
    this pixel's middle.
    """
    effects, next_effects = recorded_effects(camera), recorded_effects(next_camera)
    if not (effects and next_effects):
        return flow
    lens, next_lens = effects[0].pixel_map(camera), next_effects[0].pixel_map(next_camera)
    row, column = (np.rint(one).astype(np.intp) for one in (lens.y, lens.x))
    starts = pixels[row, column]
    ends = next_lens.forward(starts + flow.flow_px[row, column])
    height, width = lens.x.shape
    with np.errstate(invalid="ignore"):
        is_inside = np.asarray(((ends >= -0.5) & (ends < (width - 0.5, height - 0.5))).all(axis=-1))
    return Flow(
        flow_px=(ends - lens.forward(starts)).astype(np.float32),
        is_visible=flow.is_visible[row, column] & is_inside,
        actor_id=flow.actor_id[row, column],
    )
