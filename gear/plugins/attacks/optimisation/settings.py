"""How textures are optimised, as data. No torch here: options of attack plugins are made of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from gear.values.errors import FieldError

USUAL_RATE = 0.06


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """How a patch may look when it is printed and photographed: random changes, in unit space, 0 for none.

    Attributes:
        noise: standard deviation of noise on every value.
        brightness: standard deviation of one number added to all values.
        contrast: standard deviation of one factor around 1.
        blur_px: largest side of a box blur; the side is uniform between 3 and this; below 3 for none.
    """

    noise: float = 0.02
    brightness: float = 0.05
    contrast: float = 0.1
    blur_px: int = 4

    def __post_init__(self) -> None:
        for name in ("noise", "brightness", "contrast"):
            if not 0 <= getattr(self, name) <= 1:
                raise FieldError(name, f"must be 0 to 1, got {getattr(self, name):g}")
        if not 0 <= self.blur_px <= 32:
            raise FieldError("blur_px", f"must be 0 to 32, got {self.blur_px}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TextureSettings:
    """Textures under Adam, whatever is climbed; all in unit space.

    Attributes:
        height_px, width_px: of every patch.
        batch: samples a step.
        learning_rate: of Adam, at its highest, one number or one a channel; null for 0.06, or what suits the
            task where the attack knows.
        decay: whether it falls to 0 with a cosine.
        appearance: what is varied, anew for every sample of every step.
    """

    height_px: int = 150
    width_px: int = 300
    batch: int = 2
    learning_rate: float | tuple[float, float, float] | None = USUAL_RATE
    decay: bool = True
    appearance: Appearance = field(default_factory=Appearance)

    def __post_init__(self) -> None:
        for name in ("height_px", "width_px"):
            if not 2 <= getattr(self, name) <= 4096:
                raise FieldError(name, f"must be 2 to 4096, got {getattr(self, name)}")
        if not 1 <= self.batch <= 4096:
            raise FieldError("batch", f"must be 1 to 4096, got {self.batch}")
        rates = self.rate if isinstance(self.rate, tuple) else (self.rate,)
        if not all(0 < rate <= 10 for rate in rates):
            raise FieldError("learning_rate", f"must be above 0, up to 10, got {self.learning_rate}")

    @property
    def rate(self) -> float | tuple[float, float, float]:
        """The learning rate, also where none was said."""
        return USUAL_RATE if self.learning_rate is None else self.learning_rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(TextureSettings):
    """The same, with the terms' gradients brought to unit length and regularised.

    Attributes:
        smoothness: length of the smoothness term's gradient beside the objective's, which is 1.
        printability: likewise of non-printability, over what an offset press can print.
        per_term: whether every term's gradient is brought to unit length by itself; one backward pass a term.
    """

    smoothness: float = 0.1
    printability: float = 0.0
    per_term: bool = True

    def __post_init__(self) -> None:
        TextureSettings.__post_init__(self)
        for name in ("smoothness", "printability"):
            if not 0 <= getattr(self, name) <= 100:
                raise FieldError(name, f"must be 0 to 100, got {getattr(self, name):g}")
