"""jpeg_tv: JPEG compression, then total-variation denoising."""

from __future__ import annotations

from dataclasses import dataclass

from gear.contracts.defenses import Defense
from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class JpegTvConfig:
    """Options of jpeg_tv.

    Attributes:
        quality: of JPEG, 1 to 100.
        weight_levels: strength of the denoising, about the amplitude of the noise that is removed, of 0..255.
        iterations: of the denoiser.
    """

    quality: int = 60
    weight_levels: float = 16.0
    iterations: int = 20

    def __post_init__(self) -> None:
        if not 1 <= self.quality <= 100:
            raise FieldError("quality", f"must be 1 to 100, got {self.quality}")
        if not 0 < self.weight_levels <= 255:
            raise FieldError("weight_levels", f"must be above 0 and at most 255, got {self.weight_levels:g}")
        if not 1 <= self.iterations <= 1000:
            raise FieldError("iterations", f"must be 1 to 1000, got {self.iterations}")


def build(config: JpegTvConfig) -> Defense:
    """Imports OpenCV and torch when the defense is asked for."""
    from gear_defense_jpeg_tv.jpeg_tv import JpegTv

    return JpegTv(config)


spec = DefenseSpec(
    name="jpeg_tv",
    summary="JPEG compression, then total-variation denoising.",
    config=JpegTvConfig,
    build=build,
    gradient="surrogate",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[JpegTvConfig]]:
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [spec]
