"""Settings of attacks that optimise patch textures. The module does not import torch, so plugin specs load quickly."""

from __future__ import annotations

from dataclasses import dataclass, field

from gear.values.errors import FieldError

USUAL_RATE = 0.06


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """Random changes that imitate printing and photographing a patch, on values in 0..1; 0 switches a change off.

    Attributes:
        noise: standard deviation of noise on every value.
        brightness: standard deviation of an offset that is the same for all values.
        contrast: standard deviation of a factor around 1.
        blur_px: largest side of a box blur, pixels. The side is drawn uniformly from 3 to this value; below 3 there is
            no blur.
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
    """Settings of attacks that optimise patch textures with Adam, on values in 0..1.

    Attributes:
        height_px, width_px: size of every patch, pixels.
        batch: number of samples per step.
        learning_rate: peak learning rate of Adam, one number or one for each channel; null takes the attack's own rate
            for the task, 0.06 where it has none.
        decay: whether the learning rate falls to 0 along a cosine.
        appearance: random changes of the patch, drawn anew for every sample of every step.
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
        """The peak learning rate, one number or one for each channel; 0.06 if the setting is null."""
        return USUAL_RATE if self.learning_rate is None else self.learning_rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings(TextureSettings):
    """Settings of attacks that scale gradients to length 1 and use regularisers. They include the options of
    `TextureSettings`.

    Attributes:
        smoothness: length of the gradient of the smoothness term, where the objective's gradient has length 1.
        printability: length of the gradient of the non-printability term, on the same scale.
        per_term: whether the gradient of each term is scaled to length 1 separately, which needs one backward pass for
            each term.
    """

    smoothness: float = 0.1
    printability: float = 0.0
    per_term: bool = True

    def __post_init__(self) -> None:
        TextureSettings.__post_init__(self)
        for name in ("smoothness", "printability"):
            if not 0 <= getattr(self, name) <= 100:
                raise FieldError(name, f"must be 0 to 100, got {getattr(self, name):g}")
