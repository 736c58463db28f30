"""Measures objects in one view: visible pixels in the id buffer, and whole silhouettes drawn from their triangles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from gear.groundtruth.lens_warp import LensWarp
from gear.groundtruth.silhouettes import Window, bounds, count, fill, project_mesh
from gear.groundtruth.visible_parts import PartKey, VisiblePart, visible_parts
from gear.values.frames import GeomTable, SceneObject, View
from gear.values.geometry import Array
from gear.values.ground_truth import BoxPx, ObjectTruth
from gear.values.scene import CameraRecord

MOST_ROWS = 4096
"""Largest number of rows in which the part of a silhouette beyond one side of the picture is counted; of more rows
only this many are sampled.
"""

EMPTY = VisiblePart(left_px=0, top_px=0, mask=np.zeros((0, 0), dtype=np.bool_), count_px=0)


def observe_objects(
    view: View,
    geoms: GeomTable,
    objects: Mapping[int, SceneObject],
    *,
    by_label: bool = True,
    include_hidden: bool = False,
) -> tuple[ObjectTruth, ...]:
    """Measures every object except the ego car in one view.

    Silhouettes are exact to the pixel, also outside the picture; if thousands of rows lie there, their area is exact to
    a thousandth. Parts less than 10 cm in front of the camera are left out. Behind a lens silhouettes are bent in the
    same way as the ids; outside of the picture edges stay straight between corners.

    Args:
        view: id buffer and camera.
        geoms: label and object of each geom.
        objects: objects by id.
        by_label: True measures each label of an object separately, so a cyclist gives a bicycle and a rider; False
            measures the object as a whole, with its main label.
        include_hidden: whether to measure also objects that have no visible pixel but would be in the picture if no
            other object occluded them.

    Returns:
        Measurements in order of object id and label code.
    """
    seen = visible_parts(view.geom_id, geoms, objects, by_label=by_label)
    wanted: dict[PartKey, VisiblePart] = dict(seen)
    if include_hidden:
        for thing in objects.values():
            if not thing.is_ego:
                codes = np.unique(thing.shape.face_label_code) if by_label else [thing.label_code]
                for code in codes:
                    wanted.setdefault((thing.id, int(code)), EMPTY)
    vertices: dict[int, Array] = {}
    warp = LensWarp.of(view.camera)
    truths = []
    for (object_id, code), part in sorted(wanted.items(), key=lambda item: item[0]):
        thing = objects[object_id]
        if object_id not in vertices:
            vertices[object_id] = in_camera(thing, view.camera)
        faces = thing.shape.faces[thing.shape.face_label_code == code] if by_label else thing.shape.faces
        truth = _measure(object_id, code, part, vertices[object_id], faces, view.camera, warp)
        if part.count_px or truth.amodal_in_image_px:
            truths.append(truth)
    return tuple(truths)


def in_camera(scene_object: SceneObject, camera: CameraRecord) -> Array:
    """The (N, 3) vertices of an object in the camera's frame, metres.

    Args:
        scene_object: the object with its pose and its visible triangles.
        camera: the camera with its pose.
    """
    camera_from_object = camera.world_from_camera_transform.inverse().matrix @ scene_object.world_from_object.matrix
    return np.asarray(scene_object.shape.vertices_m @ camera_from_object[:3, :3].T + camera_from_object[:3, 3])


def _measure(
    object_id: int,
    code: int,
    part: VisiblePart,
    vertices_camera_m: Array,
    faces: npt.NDArray[np.int32],
    camera: CameraRecord,
    warp: LensWarp | None,
) -> ObjectTruth:
    triangles_px = project_mesh(vertices_camera_m, faces, camera.intrinsics)
    whole = bounds(triangles_px)
    picture: Window = (0, 0, camera.width_px, camera.height_px)
    rows, columns = part.mask.shape
    visible_box: BoxPx | None = None
    if part.count_px:
        left, top = part.left_px, part.top_px
        visible_box = (float(left), float(top), float(left + columns), float(top + rows))
    if warp is None:
        inside = _common(_cover(whole, visible_box), picture)
        mask = fill(triangles_px, inside)
    else:
        seen = _common(whole, picture)
        inside = _cover(warp.window(seen), visible_box)
        mask = warp.mask(fill(triangles_px, seen), seen, inside)
        triangles_px = warp.points(triangles_px)
        whole = bounds(triangles_px)
        if mask.any():
            # A curved edge may bulge beyond its ends.
            whole = _cover(whole, _tight(mask, inside))
    if part.count_px:
        # The GPU's own rounding may show a pixel that the triangles just miss; what is seen is part of the whole.
        y, x = part.top_px - inside[1], part.left_px - inside[0]
        mask[y : y + rows, x : x + columns] |= part.mask
    in_image_px = int(mask.sum())
    box = _tight(mask, inside)
    outside_px = 0
    if whole[0] < 0 or whole[1] < 0 or whole[2] > camera.width_px or whole[3] > camera.height_px:
        outside_px = _count_outside(triangles_px, whole, picture)
        box = _cover(whole, visible_box)
    return ObjectTruth(
        object_id=object_id,
        label_code=code,
        visible_px=part.count_px,
        visible_box=visible_box,
        amodal_px=in_image_px + outside_px,
        amodal_in_image_px=in_image_px,
        amodal_box=(float(box[0]), float(box[1]), float(box[2]), float(box[3])),
        pictured_box=_refined(_tight(mask, inside), triangles_px) if in_image_px else None,
        mask=part.mask,
    )


def _refined(box: Window, triangles_px: Array) -> BoxPx:
    """A box of whole pixels whose sides are moved to the ends of the triangles, to a fraction of a pixel.

    A side is not moved if the triangles end more than half a pixel away from it: either the picture's border cuts them
    there, or they end in a sliver that covers no pixel centre.

    Args:
        box: box of the silhouette in the picture.
        triangles_px: (T, 3, 2) corners in index pixels.

    Returns:
        The box in edge pixels.
    """
    whole = np.array(box, dtype=np.float64)
    if len(triangles_px):
        # The centre of the first pixel is 0 in index pixels and 0.5 in edge pixels.
        exact = np.concatenate([triangles_px.min(axis=(0, 1)), triangles_px.max(axis=(0, 1))]) + 0.5
        whole = np.where(np.abs(exact - whole) <= 0.5, exact, whole)
    left, top, right, bottom = (float(side) for side in whole)
    return (left, top, right, bottom)


def _count_outside(triangles_px: Array, whole: Window, picture: Window) -> int:
    """Number of pixels of a silhouette outside the picture."""
    (x0, y0, x1, y1), (_, _, width, height) = whole, picture
    left, right = max(x0, 0), min(x1, width)
    beyond = (
        (x0, y0, min(x1, 0), y1),
        (max(x0, width), y0, x1, y1),
        (left, y0, right, min(y1, 0)),
        (left, max(y0, height), right, y1),
    )
    return sum(count(triangles_px, window, MOST_ROWS) for window in beyond)


def _tight(mask: npt.NDArray[np.bool_], window: Window) -> Window:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return (window[0], window[1], window[0], window[1])
    x, y = window[0], window[1]
    return (x + int(columns[0]), y + int(rows[0]), x + int(columns[-1]) + 1, y + int(rows[-1]) + 1)


def _cover(window: Window, box: BoxPx | None) -> Window:
    """The smallest window that contains two windows."""
    if box is None:
        return window
    other = (int(box[0]), int(box[1]), int(box[2]), int(box[3]))
    if window[2] <= window[0] or window[3] <= window[1]:
        return other
    return (
        min(window[0], other[0]),
        min(window[1], other[1]),
        max(window[2], other[2]),
        max(window[3], other[3]),
    )


def _common(window: Window, picture: Window) -> Window:
    """The part of a window in the picture; an empty part is placed inside the picture."""
    x0, y0 = min(max(window[0], 0), picture[2]), min(max(window[1], 0), picture[3])
    return (x0, y0, max(x0, min(window[2], picture[2])), max(y0, min(window[3], picture[3])))
