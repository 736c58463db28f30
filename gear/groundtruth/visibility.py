"""Decides which objects become labels, which become regions to ignore in the evaluation, and which are left out."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import ClassVar, Literal

from gear.values.errors import FieldError
from gear.values.ground_truth import BoxPx, ObjectTruth

Preset = Literal["kitti", "coco", "carla_gear"]


@dataclass(frozen=True, slots=True, kw_only=True)
class VisibilityLimits:
    """Limits that an object must reach to become a label.

    Below the limits the object becomes a region to ignore: neither detecting nor missing it counts as an error.

    Attributes:
        max_distance_m: largest distance from the camera to the middle of the object's 3D box; None for any distance.
        min_height_px: smallest height of the box that the format writes.
        min_box_area_px2: smallest area of the tight box of the visible pixels.
        min_visible_fraction: smallest visible share of the silhouette inside the picture, 0..1. The part outside the
            picture does not count, because formats have a field of their own for it.
        min_visible_px: smallest number of visible pixels of a label.
        min_pixels_px: smallest number of visible pixels of a region to ignore; an object with fewer is left out.
    """

    max_distance_m: float | None = None
    min_height_px: float = 0.0
    min_box_area_px2: float = 0.0
    min_visible_fraction: float = 0.0
    min_visible_px: int = 0
    min_pixels_px: int = 4

    def __post_init__(self) -> None:
        if self.max_distance_m is not None and self.max_distance_m <= 0:
            raise FieldError("max_distance_m", f"must be above 0 m, got {self.max_distance_m:g}")
        for name in ("min_height_px", "min_box_area_px2", "min_visible_px"):
            if getattr(self, name) < 0:
                raise FieldError(name, f"must not be negative, got {getattr(self, name):g}")
        if not 0 <= self.min_visible_fraction <= 1:
            raise FieldError("min_visible_fraction", f"must be a share, 0 to 1, got {self.min_visible_fraction:g}")
        if self.min_pixels_px < 1:
            raise FieldError("min_pixels_px", f"must be at least 1, got {self.min_pixels_px}")

    def mentions(self, truth: ObjectTruth) -> bool:
        """Whether the object appears in the ground truth, as a label or as a region to ignore; False if it is left
        out.

        Args:
            truth: the measured object.
        """
        return truth.visible_px >= self.min_pixels_px

    def labels(self, truth: ObjectTruth, box_px: BoxPx, distance_m: float) -> bool:
        """Whether the object becomes a label, not only a region to ignore.

        Args:
            truth: the measured object.
            box_px: the box that the format writes: left, top, right, bottom.
            distance_m: distance from the camera to the middle of the object's 3D box.
        """
        if truth.visible_box is None or not self.mentions(truth):
            return False
        left, top, right, bottom = truth.visible_box
        return (
            (self.max_distance_m is None or distance_m <= self.max_distance_m)
            and box_px[3] - box_px[1] >= self.min_height_px
            and (right - left) * (bottom - top) >= self.min_box_area_px2
            and truth.uncovered_fraction >= self.min_visible_fraction
            and truth.visible_px >= self.min_visible_px
        )


PRESETS: dict[Preset, VisibilityLimits] = {
    "kitti": VisibilityLimits(min_height_px=24.0, min_visible_fraction=0.1),
    "coco": VisibilityLimits(min_visible_px=100),
    "carla_gear": VisibilityLimits(
        max_distance_m=200.0, min_box_area_px2=900.0, min_visible_fraction=0.1, min_visible_px=100
    ),
}
"""Limits by name of the preset.

`kitti`: objects that some difficulty of KITTI's evaluation counts, which are at least 25 px high. The sides of boxes
are given to a fraction of a pixel, so the box of a silhouette of 25 rows of pixels can be a pixel lower; the limit is
therefore 24 px. `coco`: objects with 100 visible pixels. `carla_gear`: the limits of the CARLA-GeAR paper, 200 m and
900 px², and further limits by gear.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Visibility:
    """Option of a task: a preset of visibility limits, and limits that replace those of the preset.

    Attributes:
        preset: which objects get labels. `kitti`: at least 24 px high and at least a tenth visible. `coco`: at least
            100 visible pixels. `carla_gear`, as in the CARLA-GeAR paper: at most 200 m away, with a visible box of at
            least 900 px², at least a tenth and at least 100 pixels visible.
        max_distance_m: largest distance from the camera to the middle of the object's 3D box.
        min_height_px: smallest height of the box that the format writes.
        min_box_area_px2: smallest area of the tight box of the visible pixels.
        min_visible_fraction: smallest visible share of the silhouette inside the picture, 0 to 1.
        min_visible_px: smallest number of visible pixels of a label.
        min_pixels_px: smallest number of visible pixels of a region to ignore.
    """

    SHORTHAND: ClassVar[str] = "preset"

    preset: Preset
    max_distance_m: float | None = None
    min_height_px: float | None = None
    min_box_area_px2: float | None = None
    min_visible_fraction: float | None = None
    min_visible_px: int | None = None
    min_pixels_px: int | None = None

    def __post_init__(self) -> None:
        self.limits()

    def limits(self) -> VisibilityLimits:
        """The limits of the preset, replaced by the limits that the user gave.

        Raises:
            FieldError: a limit is out of its range.
        """
        given = {field.name: getattr(self, field.name) for field in fields(VisibilityLimits)}
        return replace(PRESETS[self.preset], **{name: value for name, value in given.items() if value is not None})
