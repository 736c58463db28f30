"""Options of the defense Jedi and their checks."""

from __future__ import annotations

from dataclasses import dataclass

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class JediConfig:
    """Options of Jedi; the defaults of `least_share`, `hidden` and `epochs` are those of the authors' code.

    Attributes:
        least_share: components of the mask below this share of the picture are removed, 0 to 1.
        autoencoder: whether an autoencoder that is trained on the calibration's masks completes masks.
        radius_px: radius around a pixel from which inpainting takes colours.
        max_pictures: largest number of calibration samples that are read.
        rows: rows of the grid on which masks are completed.
        hidden: hidden units of the autoencoder.
        epochs: training steps of the autoencoder.
        draws: training masks of the autoencoder, drawn from the calibration's masks at random places.
    """

    least_share: float = 0.005
    autoencoder: bool = True
    radius_px: int = 5
    max_pictures: int = 50
    rows: int = 32
    hidden: int = 100
    epochs: int = 100
    draws: int = 200

    def __post_init__(self) -> None:
        if not 0 <= self.least_share < 1:
            raise FieldError("least_share", f"must be 0 or more and less than 1, got {self.least_share:g}")
        for name, most in (("radius_px", 100), ("rows", 256), ("hidden", 1000), ("epochs", 10_000), ("draws", 10_000)):
            if not 1 <= getattr(self, name) <= most:
                raise FieldError(name, f"must be 1 to {most}, got {getattr(self, name)}")
        if self.max_pictures < 1:
            raise FieldError("max_pictures", f"must be at least 1, got {self.max_pictures}")
