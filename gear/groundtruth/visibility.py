"""When an object counts as seen."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError
from gear.values.ground_truth import ObjectTruth


@dataclass(frozen=True, slots=True, kw_only=True)
class VisibilityLimits:
    """What an object must show to be labelled. One that shows less is marked as ignored, so that finding it is no
    mistake and missing it none either; one with fewer than `min_pixels_px` visible pixels is left out altogether.

    Attributes:
        max_distance_m: camera to the middle of its 3D box; CARLA-GeAR's 200 m.
        min_box_area_px2: area of the tight box of its visible pixels; CARLA-GeAR's 900 px².
        min_visible_fraction: share of its silhouette in the picture that nothing covers. What lies outside the
            picture is not held against it: formats say that in a field of their own.
        min_visible_px: visible pixels that a label needs, whatever the box around them.
        min_pixels_px: visible pixels that it needs to be mentioned at all.
    """

    max_distance_m: float = 200.0
    min_box_area_px2: float = 900.0
    min_visible_fraction: float = 0.1
    min_visible_px: int = 100
    min_pixels_px: int = 4

    def __post_init__(self) -> None:
        if self.max_distance_m <= 0:
            raise FieldError("max_distance_m", f"must be above 0 m, got {self.max_distance_m:g}")
        if self.min_box_area_px2 < 0:
            raise FieldError("min_box_area_px2", f"must not be negative, got {self.min_box_area_px2:g}")
        if not 0 <= self.min_visible_fraction <= 1:
            raise FieldError("min_visible_fraction", f"is a share, 0 to 1, got {self.min_visible_fraction:g}")
        if self.min_visible_px < 0:
            raise FieldError("min_visible_px", f"must not be negative, got {self.min_visible_px}")
        if self.min_pixels_px < 1:
            raise FieldError("min_pixels_px", f"must be at least 1, got {self.min_pixels_px}")

    def mentions(self, truth: ObjectTruth) -> bool:
        """Whether there is enough to see to say anything of it."""
        return truth.visible_px >= self.min_pixels_px

    def labels(self, truth: ObjectTruth, distance_m: float) -> bool:
        """Whether it is labelled as an object."""
        if truth.visible_box is None or not self.mentions(truth):
            return False
        left, top, right, bottom = truth.visible_box
        return (
            distance_m <= self.max_distance_m
            and (right - left) * (bottom - top) >= self.min_box_area_px2
            and truth.uncovered_fraction >= self.min_visible_fraction
            and truth.visible_px >= self.min_visible_px
        )
