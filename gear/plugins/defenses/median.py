"""A defense that applies a median filter to every picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import Mask, PerPicture
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class MedianConfig:
    """Options of the median filter.

    Attributes:
        radius_px: radius of the window, 1 to 5; its side is 2 * radius + 1 pixels.
    """

    radius_px: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.radius_px <= 5:
            raise FieldError("radius_px", f"must be 1 to 5, got {self.radius_px}")


class Median(PerPicture):
    """A defense that replaces each value by the median of its channel over a square window; borders are
    replicated.

    Args:
        config: options of the defense.
    """

    def __init__(self, config: MedianConfig) -> None:
        self._side_px = 2 * config.radius_px + 1

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Returns the median-filtered picture, and None instead of a mask.

        Args:
            picture: (H, W, 3) uint8 sRGB.
        """
        return np.asarray(cv2.medianBlur(np.ascontiguousarray(picture), self._side_px), np.uint8), None

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Returns the median-filtered pictures; the gradient goes to the median pixel of each window.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        from torch.nn import functional

        batch, channels, height, width = pictures.shape
        radius = self._side_px // 2
        padded = functional.pad(pictures, (radius,) * 4, mode="replicate")
        windows = functional.unfold(padded, self._side_px).view(batch, channels, self._side_px**2, height, width)
        return windows.median(dim=2).values


spec = DefenseSpec(
    name="median",
    summary="Median filter on every picture.",
    config=MedianConfig,
    build=Median,
    gradient="differentiable",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[MedianConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
