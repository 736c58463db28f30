"""Local gradients smoothing (Naseer et al., WACV 2019): regions with strong gradients are darkened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.masking.entropy import GREY, grey_tensor
from gear.plugins.defenses.per_picture import Mask, PerPicture
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

LEAST_SPREAD = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class LgsConfig:
    """Options of local gradients smoothing; the defaults are the paper's values.

    Attributes:
        window_px: side of the windows, pixels.
        overlap_px: overlap of neighbouring windows, pixels.
        threshold: a window is processed if its mean normalised gradient exceeds this value, 0 to 1.
        strength: factor lambda on the gradient.
    """

    window_px: int = 15
    overlap_px: int = 5
    threshold: float = 0.1
    strength: float = 2.3

    def __post_init__(self) -> None:
        if not 2 <= self.window_px <= 512:
            raise FieldError("window_px", f"must be 2 to 512, got {self.window_px}")
        if not 0 <= self.overlap_px < self.window_px:
            raise FieldError("overlap_px", f"must be smaller than the window, got {self.overlap_px}")
        if not 0 <= self.threshold <= 1:
            raise FieldError("threshold", f"must be 0 to 1, got {self.threshold:g}")
        if self.strength <= 0:
            raise FieldError("strength", f"must be > 0, got {self.strength:g}")


class Lgs(PerPicture):
    """Local gradients smoothing of a picture x: x * (1 - clip(lambda * g * B, 0, 1)).

    The gradient g holds first-order differences of the grey picture, normalised to 0..1 for each picture. B is 1 in the
    windows whose mean gradient exceeds the threshold, otherwise 0. Windows that reach over the right or lower border
    are averaged over their part inside, so no strip of the picture is left out.

    Args:
        config: options of the defense.
    """

    def __init__(self, config: LgsConfig) -> None:
        self._config = config
        self._stride_px = config.window_px - config.overlap_px

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Returns the darkened picture, and the (H, W) mask of how much each pixel was darkened, 0..1.

        Args:
            picture: (H, W, 3) uint8 sRGB.
        """
        unit = picture.astype(np.float32) / 255
        grey = unit @ np.array(GREY, np.float32)
        dx, dy = np.zeros_like(grey), np.zeros_like(grey)
        dx[:, :-1] = grey[:, :-1] - grey[:, 1:]
        dy[:-1] = grey[:-1] - grey[1:]
        gradient: Mask = np.hypot(dx, dy)
        low, high = float(gradient.min()), float(gradient.max())
        gradient = ((gradient - low) / (high - low + LEAST_SPREAD)).astype(np.float32)
        mask = np.clip(self._config.strength * gradient * self._busy(gradient), 0, 1)
        return np.rint(unit * (1 - mask[..., None]) * 255).astype(np.uint8), mask.astype(np.float32)

    def _busy(self, gradient: Mask) -> Mask:
        """The (H, W) union of the windows whose mean gradient exceeds the threshold: 1 inside, 0 outside."""
        height, width = gradient.shape
        sums = cv2.integral(gradient, sdepth=cv2.CV_64F)
        top, left = self._starts(height), self._starts(width)
        bottom = np.minimum(top + self._config.window_px, height)
        right = np.minimum(left + self._config.window_px, width)
        total = sums[bottom][:, right] - sums[top][:, right] - sums[bottom][:, left] + sums[top][:, left]
        area = (bottom - top)[:, None] * (right - left)[None, :]
        busy = np.zeros((height, width), np.float32)
        for i, j in np.argwhere(total / area > self._config.threshold):
            busy[top[i] : bottom[i], left[j] : right[j]] = 1
        return busy

    def _starts(self, size_px: int) -> np.ndarray:
        count = max(0, -(-(size_px - self._config.window_px) // self._stride_px)) + 1
        return np.arange(count) * self._stride_px

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Returns the darkened pictures, by the same operation in torch; differentiable, but the choice of windows
        has no gradient.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        import torch

        grey = grey_tensor(pictures)[:, None]
        dx, dy = torch.zeros_like(grey), torch.zeros_like(grey)
        dx[..., :-1] = grey[..., :-1] - grey[..., 1:]
        dy[..., :-1, :] = grey[..., :-1, :] - grey[..., 1:, :]
        square = dx**2 + dy**2
        gradient = torch.where(square > 0, square.clamp_min(1e-20).sqrt(), torch.zeros_like(square))
        low, high = gradient.amin((1, 2, 3), keepdim=True), gradient.amax((1, 2, 3), keepdim=True)
        gradient = (gradient - low) / (high - low + LEAST_SPREAD)
        maps = gradient.detach()[:, 0].float().cpu().numpy()
        busy = torch.from_numpy(np.stack([self._busy(np.ascontiguousarray(one)) for one in maps])).to(pictures)
        mask = (self._config.strength * gradient * busy[:, None]).clamp(0, 1)
        return pictures * (1 - mask)


spec = DefenseSpec(
    name="lgs",
    summary="Local gradients smoothing: darkens regions with strong gradients (a defense of the paper).",
    config=LgsConfig,
    build=Lgs,
    outputs=frozenset({"images", "mask", "score"}),
    gradient="differentiable",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[LgsConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
