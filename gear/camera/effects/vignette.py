"""Vignette: the corners of the picture are darker than its middle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gear.camera.effects.effect import Effect, Exposure
from gear.contracts.rendering import RawView
from gear.values.errors import FieldError
from gear.values.frames import FloatImage

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class Vignette(Effect):
    """Darkening by the cos^4 law: light decreases with the fourth power of the cosine of the angle to the optical axis.

    Attributes:
        vignette: share of light that the corners lose, 0 to 0.95.
    """

    ORDER: ClassVar[int] = 30

    vignette: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.vignette <= 0.95:
            raise FieldError("vignette", f"must be 0 to 0.95, got {self.vignette:g}")

    @property
    def is_active(self) -> bool:
        """Whether the vignette is on: the corners lose light."""
        return self.vignette > 0

    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """Darkens the corners of a view; colours are rounded.

        Args:
            view: the view without vignette, with colour.
            exposure: not used.
        """
        import cv2  # imported here, so that configs can be read without OpenCV

        assert view.linear_rgb is not None
        share = vignette_map(self.vignette, view.linear_rgb.shape[1], view.linear_rgb.shape[0])
        dimmed = cv2.multiply(view.linear_rgb, cv2.merge([share, share, share]), dtype=cv2.CV_16U)
        return replace(view, linear_rgb=np.asarray(dimmed, dtype=np.uint16))

    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """Darkens the corners of (B, 3, H, W) linear light in torch, differentiable and without rounding.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of the picture; its colour is not used.
            exposure: camera and scene of the picture.
        """
        return light * light.new_tensor(vignette_map(self.vignette, light.shape[-1], light.shape[-2]))


@lru_cache(maxsize=8)
def vignette_map(strength: float, width_px: int, height_px: int) -> FloatImage:
    """The (H, W) float32 factors on light of a vignette, read-only: 1 in the middle of the picture, 1 - `strength` in
    the corners.

    Args:
        strength: darkening of the corners, 0..1.
        width_px, height_px: size of the picture.
    """
    x, y = np.meshgrid(np.linspace(-1, 1, width_px), np.linspace(-1, 1, height_px))
    aspect = height_px / width_px
    square = (x**2 + (aspect * y) ** 2) / (1 + aspect**2)
    # The fourth power of the cosine of an angle with tangent r is 1 / (1 + r²)².
    share = (1 / (1 + ((1 - strength) ** -0.5 - 1) * square) ** 2).astype(np.float32)
    share.setflags(write=False)
    return np.asarray(share)
