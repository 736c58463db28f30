"""Measures patch surfaces (the rectangles that show patches) in one view: corners, visible pixels, distance and
angle.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from gear.formats import rle
from gear.groundtruth.lens_warp import LensWarp
from gear.groundtruth.silhouettes import NEAR_M
from gear.values.frames import GeomTable, View
from gear.values.geometry import Array
from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import SceneRecord, SurfaceRecord

UNIT_CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
"""Patch coordinates (u right, v down) of the patch's corners: top left, top right, bottom right, bottom left."""

CURVE_STEPS = 32
"""Number of straight pieces by which an edge of a surface is approximated behind a lens, where edges are curves."""


def observe_surfaces(view: View, geoms: GeomTable, record: SceneRecord) -> tuple[SurfaceTruth, ...]:
    """Measures each patch surface of a scene in one view: corners, visible pixels, distance and angle.

    Args:
        view: id buffer and camera.
        geoms: the surface that each geom shows.
        record: the scene with its surfaces and the poses of the actors that carry them.

    Returns:
        One entry for each surface, in the order of `record.surfaces`, also for surfaces that are not visible.
    """
    return tuple(_observe(view, geoms, record, index, surface) for index, surface in enumerate(record.surfaces))


def _observe(view: View, geoms: GeomTable, record: SceneRecord, index: int, surface: SurfaceRecord) -> SurfaceTruth:
    camera = view.camera
    camera_from_world = camera.world_from_camera_transform.inverse()
    camera_from_surface = camera_from_world @ record.world_from_surface(surface)
    rotation, middle_m = camera_from_surface.rotation, camera_from_surface.translation_m
    right_m, down_m = rotation[:, 0] * surface.width_m, rotation[:, 1] * surface.height_m
    top_left_m = middle_m - (right_m + down_m) / 2
    corners_m = np.array([top_left_m + u * right_m + v * down_m for u, v in UNIT_CORNERS])
    corners_px = image_from_unit = None
    if corners_m[:, 2].min() >= NEAR_M:
        pixels = camera.intrinsics.project(corners_m)
        corners_px = tuple((round(float(x), 6), round(float(y), 6)) for x, y in pixels)
        homography = camera.intrinsics.matrix @ np.stack([right_m, down_m, top_left_m], axis=1)
        image_from_unit = tuple(round(float(v), 9) for v in (homography / homography[2, 2]).reshape(-1))
    height, width = view.geom_id.shape
    mask = np.zeros((height, width), dtype=np.uint8)
    for geom in np.flatnonzero(geoms.surface_index == index).tolist():
        mask |= cv2.inRange(view.geom_id, geom, geom)
    visible_px = cv2.countNonZero(mask)
    left, top, columns, rows = cv2.boundingRect(mask)
    seen = mask[top : top + rows, left : left + columns] > 0
    silhouette_px2 = _area_px2(corners_m, view)
    distance_m = float(np.linalg.norm(middle_m))
    # The face looks along -z of its own frame; the camera sits at the origin of the camera frame.
    cosine = float(rotation[:, 2] @ middle_m) / distance_m if distance_m else 1.0
    return SurfaceTruth(
        name=surface.name,
        camera=camera.name,
        camera_from_surface=tuple(round(float(v), 9) for v in camera_from_surface.matrix.reshape(-1)),
        corners_px=corners_px,
        image_from_unit=image_from_unit,
        visible_px=visible_px,
        visible_fraction=round(min(1.0, visible_px / silhouette_px2), 6) if silhouette_px2 > 0 else 0.0,
        distance_m=round(distance_m, 6),
        incidence_deg=round(math.degrees(math.acos(max(-1.0, min(1.0, cosine)))), 6),
        mask_rle=rle.encode_crop(seen, left, top, height, width),
    )


def _area_px2(corners_m: Array, view: View) -> float:
    """Area in square pixels of the projected face, clipped at the near plane but not to the picture."""
    polygon: list[Array] = []
    for a, b in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        if a[2] >= NEAR_M:
            polygon.append(a)
        if (a[2] >= NEAR_M) != (b[2] >= NEAR_M):
            polygon.append(a + (NEAR_M - a[2]) / (b[2] - a[2]) * (b - a))
    if len(polygon) < 3:
        return 0.0
    warp = LensWarp.of(view.camera)
    if warp is None:
        x, y = view.camera.intrinsics.project(np.array(polygon)).T
    else:
        # Behind a lens edges are curves.
        steps = np.linspace(0, 1, CURVE_STEPS, endpoint=False)[:, None]
        curve = [a + steps * (b - a) for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True)]
        x, y = warp.points(view.camera.intrinsics.project(np.concatenate(curve))).T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
