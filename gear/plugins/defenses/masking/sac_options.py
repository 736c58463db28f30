"""Options of the defense SAC and their checks."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class SacConfig:
    """Options of SAC.

    Attributes:
        completes_shape: whether masks are completed to rectangles.
        width_px: width to which pictures are reduced for the segmenter.
        filters: channels of the U-Net at that resolution; the authors use 16 (COCO) and 64 (APRICOT).
        steps: number of training steps.
        max_pictures: largest number of calibration samples that are read.
    """

    completes_shape: bool = True
    width_px: int = 512
    filters: int = 16
    steps: int = 300
    max_pictures: int = 50

    def __post_init__(self) -> None:
        for name, least, most in (("width_px", 32, 8192), ("filters", 2, 256), ("steps", 1, 100_000)):
            if not least <= getattr(self, name) <= most:
                raise FieldError(name, f"must be {least} to {most}, got {getattr(self, name)}")
        if self.max_pictures < 1:
            raise FieldError("max_pictures", f"must be at least 1, got {self.max_pictures}")
