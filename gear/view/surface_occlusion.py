"""Truncation and occlusion of a patch surface in a picture."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import CameraRecord

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Hidden:
    """The invisible shares of a surface's outline, 0..1; None if a corner is behind the camera or the surface
    faces away.

    Attributes:
        truncated_fraction: share of the outline's area that lies outside the picture.
        occluded_fraction: occluded share of the part inside the picture; None also if no part is inside.
    """

    truncated_fraction: float | None
    occluded_fraction: float | None


def hidden(truth: SurfaceTruth, camera: CameraRecord) -> Hidden:
    """Computes the truncated and the occluded share of a surface from its projected corners and its number of visible
    pixels.

    Args:
        truth: the surface as one camera sees it.
        camera: that camera.

    Returns:
        Both shares are None if the camera sees the surface from behind or corners lie behind the camera; the occluded
        share is None if less than one pixel lies inside the picture.
    """
    if truth.corners_px is None or truth.incidence_deg >= 90:
        return Hidden(None, None)
    outline = [(x, y) for x, y in truth.corners_px]
    whole = area_px2(outline)
    if whole <= 0:
        return Hidden(None, None)
    inside = area_px2(clipped(outline, camera.width_px - 0.5, camera.height_px - 0.5))
    occluded = max(0.0, 1.0 - truth.visible_px / inside) if inside >= 1.0 else None
    return Hidden(max(0.0, 1.0 - inside / whole), occluded)


def clipped(polygon: list[Point], right: float, bottom: float) -> list[Point]:
    """Returns the part of a convex polygon inside [-0.5, right] x [-0.5, bottom]; in these coordinates pixel
    centres are integers.
    """
    for axis, bound, sign in ((0, -0.5, 1.0), (0, right, -1.0), (1, -0.5, 1.0), (1, bottom, -1.0)):
        kept: list[Point] = []
        for a, b in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            in_a, in_b = sign * (a[axis] - bound), sign * (b[axis] - bound)
            if in_a >= 0:
                kept.append(a)
            if (in_a >= 0) != (in_b >= 0):
                t = in_a / (in_a - in_b)
                kept.append((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
        polygon = kept
    return polygon


def area_px2(polygon: list[Point]) -> float:
    """Returns the area in square pixels of a polygon without self-intersections; 0 for fewer than three corners."""
    pairs = zip(polygon, polygon[1:] + polygon[:1], strict=True)
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs)) / 2
