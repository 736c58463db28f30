"""How a patch may look when it is printed and photographed: expectation over appearance (CARLA-GeAR's transforms)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """Random changes of a patch before it is put into a picture; all in unit space, 0 for none.

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

    def vary(self, patch: Tensor, rng: np.random.Generator) -> Tensor:
        """One look of a (3, h, w) patch in 0..1, differentiable; in the order noise, brightness, contrast, blur."""
        brightness, contrast, seed = rng.normal(), rng.normal(), int(rng.integers(2**63))
        side = int(rng.integers(3, max(self.blur_px, 3) + 1))
        seen = patch
        if self.noise:
            generator = torch.Generator(device="cpu").manual_seed(seed)
            noise = torch.randn(patch.shape, generator=generator, dtype=patch.dtype).to(patch.device)
            seen = (seen + self.noise * noise).clamp(0, 1)
        seen = ((seen + self.brightness * brightness) * (1 + self.contrast * contrast)).clamp(0, 1)
        return _box_blurred(seen, side) if self.blur_px >= 3 else seen


def _box_blurred(patch: Tensor, side: int) -> Tensor:
    before, after = (side - 1) // 2, side // 2
    padded = functional.pad(patch[None], (before, after, before, after), mode="replicate")
    return functional.avg_pool2d(padded, side, stride=1)[0]
