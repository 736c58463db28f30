"""Optional effects of the camera, as data: all off unless a config turns them on."""

from __future__ import annotations

from dataclasses import dataclass, field

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """Brown and Conrady's radial distortion, about the middle of the picture.

    A point that a pinhole sees at (x, y) in units of its focal length appears at (x, y) (1 + k1 r² + k2 r⁴).

    Attributes:
        k1, k2: barrel below 0, cushion above; -0.5 to 0.5.
    """

    k1: float = 0.0
    k2: float = 0.0

    def __post_init__(self) -> None:
        for name in ("k1", "k2"):
            if not -0.5 <= getattr(self, name) <= 0.5:
                raise FieldError(name, f"must be -0.5 to 0.5, got {getattr(self, name):g}")

    @property
    def bends(self) -> bool:
        """Whether it does anything."""
        return self.k1 != 0 or self.k2 != 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LensRecord:
    """A lens before one camera: with the camera's size and focal length, all that its map is made of.

    Attributes:
        k1, k2: as in `Lens`.
        focal_px: of the distorted picture; longer than the pinhole's where its corners would be empty.
    """

    k1: float
    k2: float
    focal_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraEffects:
    """What a real camera adds to a picture.

    Attributes:
        shot_noise: standard deviation at full scale, in percent of full scale; it grows with the root of light.
        read_noise: standard deviation in the dark, in percent of full scale.
        vignette: share of light that the corners lose, 0 to 0.95.
        shutter_s: exposure time, which smears what the moving ego car passes; 0 is none.
        lens: distortion.
    """

    shot_noise: float = 0.0
    read_noise: float = 0.0
    vignette: float = 0.0
    shutter_s: float = 0.0
    lens: Lens = field(default_factory=Lens)

    def __post_init__(self) -> None:
        for name in ("shot_noise", "read_noise"):
            if not 0 <= getattr(self, name) <= 20:
                raise FieldError(name, f"must be 0 to 20 percent, got {getattr(self, name):g}")
        if not 0 <= self.vignette <= 0.95:
            raise FieldError("vignette", f"must be 0 to 0.95, got {self.vignette:g}")
        if not 0 <= self.shutter_s <= 0.1:
            raise FieldError("shutter_s", f"must be 0 to 0.1 s, got {self.shutter_s:g}")
