"""A defense that blurs every picture with a Gaussian."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import Mask, PerPicture
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianConfig:
    """Options of the blur.

    Attributes:
        sigma_px: standard deviation in pixels, 0.1 to 20; the kernel reaches three standard deviations.
    """

    sigma_px: float = 1.0

    def __post_init__(self) -> None:
        if not 0.1 <= self.sigma_px <= 20:
            raise FieldError("sigma_px", f"must be 0.1 to 20, got {self.sigma_px:g}")


class Gaussian(PerPicture):
    """A defense that blurs sRGB values with a separable kernel; borders are mirrored without repeating the edge.

    Args:
        config: options of the defense.
    """

    def __init__(self, config: GaussianConfig) -> None:
        radius = max(1, math.ceil(3 * config.sigma_px))
        offsets = np.arange(-radius, radius + 1)
        kernel = np.exp(-0.5 * (offsets / config.sigma_px) ** 2)
        self._kernel: npt.NDArray[np.float32] = (kernel / kernel.sum()).astype(np.float32)

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Returns the blurred picture, and None instead of a mask.

        Args:
            picture: (H, W, 3) uint8 sRGB.
        """
        blurred = cv2.sepFilter2D(
            picture.astype(np.float32), -1, self._kernel, self._kernel, borderType=cv2.BORDER_REFLECT_101
        )
        return np.clip(np.rint(blurred), 0, 255).astype(np.uint8), None

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Returns the blurred pictures, by the same convolution in torch; differentiable.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        import torch
        from torch.nn import functional

        kernel = torch.from_numpy(self._kernel).to(pictures)
        radius, channels = len(kernel) // 2, pictures.shape[1]
        padded = pictures
        for axis in (2, 3):
            places = torch.from_numpy(_mirrored(pictures.shape[axis], radius)).to(pictures.device)
            padded = padded.index_select(axis, places)
        rows = functional.conv2d(padded, kernel.view(1, 1, 1, -1).expand(channels, 1, 1, -1), groups=channels)
        return functional.conv2d(rows, kernel.view(1, 1, -1, 1).expand(channels, 1, -1, 1), groups=channels)


def _mirrored(side_px: int, radius_px: int) -> npt.NDArray[np.int64]:
    """Indices of the pixels of a line of `side_px` pixels with mirrored borders of `radius_px` pixels.

    If a border is wider than the line, the line is mirrored repeatedly; torch's own padding does not allow such
    borders.
    """
    there_and_back_px = max(2 * (side_px - 1), 1)
    steps = np.arange(-radius_px, side_px + radius_px) % there_and_back_px
    return np.minimum(steps, there_and_back_px - steps) if side_px > 1 else np.zeros_like(steps)


spec = DefenseSpec(
    name="gaussian",
    summary="Gaussian blur on every picture.",
    config=GaussianConfig,
    build=Gaussian,
    gradient="differentiable",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[GaussianConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
