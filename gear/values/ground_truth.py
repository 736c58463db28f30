"""Measured ground truth: the visible parts of objects and surfaces in one view, and their positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

BoxPx = tuple[float, float, float, float]
"""A box in the picture: left, top, right, bottom in edge pixels.

In edge pixels the picture spans [0, W] x [0, H]; a mask over columns a..b has left a and right b + 1.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ObjectTruth:
    """Measured visibility of one object (or one labelled part of it, such as a rider) in one view.

    Attributes:
        object_id: id of the object, as in `GeomTable.object_id`.
        label_code: label code of the measured part.
        visible_px: number of its pixels in the id buffer.
        visible_box: tight box of the visible pixels, None if there are none.
        amodal_px: number of pixels of the whole silhouette, inside and outside the picture, occluded parts included.
        amodal_in_image_px: number of pixels of the whole silhouette inside the picture.
        amodal_box: tight box of the whole silhouette, may extend beyond the picture.
        pictured_box: tight box of the silhouette inside the picture, to a fraction of a pixel; None if no part is
            inside.
        mask: (h, w) bool of the visible pixels inside `visible_box`.
    """

    object_id: int
    label_code: int
    visible_px: int
    visible_box: BoxPx | None
    amodal_px: int
    amodal_in_image_px: int
    amodal_box: BoxPx
    pictured_box: BoxPx | None
    mask: npt.NDArray[np.bool_]

    @property
    def visible_fraction(self) -> float:
        """Visible share of the whole silhouette, inside and outside the picture, 0..1."""
        return min(1.0, self.visible_px / self.amodal_px) if self.amodal_px else 0.0

    @property
    def uncovered_fraction(self) -> float:
        """Visible share of the silhouette inside the picture, 0..1; the rest is occluded.

        The share is a quotient of pixel counts, so limits are met exactly: 3 of 30 pixels are 0.1, whereas 1 - 0.9 is
        less than 0.1 in floating point.
        """
        return min(1.0, self.visible_px / self.amodal_in_image_px) if self.amodal_in_image_px else 1.0

    @property
    def occluded_fraction(self) -> float:
        """Share of the silhouette inside the picture that other objects occlude, 0..1."""
        return 1.0 - self.uncovered_fraction

    @property
    def truncated_fraction(self) -> float:
        """Share of the whole silhouette that lies outside the picture, 0..1."""
        return 1.0 - self.amodal_in_image_px / self.amodal_px if self.amodal_px else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceTruth:
    """Measured visibility and position of one patch surface in one view; JSON-ready.

    The face is the rectangle of the surface that shows the patch.

    Attributes:
        name: name of the surface, as in `SurfaceRecord.name`.
        camera: name of the view.
        camera_from_surface: (4, 4) row-major, as 16 numbers.
        corners_px: index pixels of the corners (top left, top right, bottom right, bottom left of the patch); None if a
            corner lies behind the camera.
        image_from_unit: homography as 9 row-major numbers from patch coordinates (u right, v down, 0..1 over the face)
            to index pixels; None if a corner lies behind the camera.
        visible_px: number of pixels of the face in the id buffer.
        visible_fraction: visible share of the face's silhouette inside and outside the picture.
        distance_m: distance from the camera to the middle of the face.
        incidence_deg: angle between the face's outward normal and the direction to the camera; 0 is head-on, above 90
            is behind the face.
        mask_rle: COCO run-length encoding of the visible mask, compressed string, for size (H, W).
    """

    name: str
    camera: str
    camera_from_surface: tuple[float, ...]
    corners_px: tuple[tuple[float, float], ...] | None
    image_from_unit: tuple[float, ...] | None
    visible_px: int
    visible_fraction: float
    distance_m: float
    incidence_deg: float
    mask_rle: str
