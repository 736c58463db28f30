"""Options of the defense NutNet and their checks."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class NutNetConfig:
    """Options of NutNet.

    Attributes:
        width_px: width to which pictures are reduced; with the authors' 416 pixels, a picture is 32 blocks wide.
        coarse_threshold: mean squared error of a block, for values in -1..1, above which the block is suspicious. null
            takes the threshold with the best mask on the patched calibration pictures, and without such pictures the
            authors' 0.125.
        fine_threshold: sum of the absolute errors of a pixel's three channels above which a pixel of a suspicious block
            becomes grey; the authors use 0.2, 0.25 or 0.3.
        steps: number of training steps of the autoencoder.
        max_pictures: largest number of calibration samples that are read.
    """

    width_px: int = 416
    coarse_threshold: float | None = None
    fine_threshold: float = 0.3
    steps: int = 2000
    max_pictures: int = 50

    def __post_init__(self) -> None:
        for name, least, most in (("width_px", 32, 8192), ("steps", 1, 100_000)):
            if not least <= getattr(self, name) <= most:
                raise FieldError(name, f"must be {least} to {most}, got {getattr(self, name)}")
        for name, highest in (("coarse_threshold", 4.0), ("fine_threshold", 6.0)):
            value = getattr(self, name)
            if value is not None and not 0 < value <= highest:
                raise FieldError(name, f"must be above 0, up to {highest:g}, got {value:g}")
        if self.max_pictures < 1:
            raise FieldError("max_pictures", f"must be at least 1, got {self.max_pictures}")
