"""Noise of the sensor: shot noise of light and read noise of the electronics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from gear.camera.effects.effect import Effect, Exposure, Pixels
from gear.contracts.rendering import RawView
from gear.values.errors import FieldError
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage
from gear.values.rng import derive_rng

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise(Effect):
    """Gaussian sensor noise whose variance is a constant plus a part that is proportional to light.

    The random draws depend only on the sample's seed, its index and the camera's name, so a sample has the same noise
    with and without a patch.

    Attributes:
        shot_noise: standard deviation at full scale, 0 to 20 percent of full scale; it grows with the square root of
            light.
        read_noise: standard deviation in the dark, 0 to 20 percent of full scale.
    """

    ORDER: ClassVar[int] = 40
    IS_LINEAR: ClassVar[bool] = False

    shot_noise: float = 0.0
    read_noise: float = 0.0

    def __post_init__(self) -> None:
        for name in ("shot_noise", "read_noise"):
            if not 0 <= getattr(self, name) <= 20:
                raise FieldError(name, f"must be 0 to 20 percent, got {getattr(self, name):g}")

    @property
    def is_active(self) -> bool:
        """Whether the noise is on: one of the two standard deviations is above 0."""
        return self.shot_noise > 0 or self.read_noise > 0

    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """Adds noise to the colour of a view, rounded and clipped to 0..`LINEAR_FULL_SCALE`.

        Args:
            view: the view without noise, with colour.
            exposure: camera and scene of the picture; they determine the random draws.
        """
        assert view.linear_rgb is not None
        light = view.linear_rgb.astype(np.float32)
        variance = light * np.float32((self.shot_noise / 100) ** 2 * LINEAR_FULL_SCALE)
        variance += np.float32((self.read_noise / 100 * LINEAR_FULL_SCALE) ** 2)
        light += np.sqrt(variance) * _draws(exposure)
        clipped: npt.NDArray[np.float32] = np.clip(light + np.float32(0.5), 0, LINEAR_FULL_SCALE)
        return replace(view, linear_rgb=clipped.astype(np.uint16))

    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """Adds noise to (B, 3, H, W) linear light in torch, differentiable, without rounding and clipping.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of the picture; its colour is not used.
            exposure: camera and scene of the picture.
        """
        return self._noisy(light, light.new_tensor(_draws(exposure).transpose(2, 0, 1)))

    def torch_at(self, pixels: tuple[Pixels, Pixels], exposure: Exposure, like: Tensor) -> Callable[[Tensor], Tensor]:
        """The noise on selected pixels, as a differentiable function of their (N, 3) linear light, without clipping.

        Args:
            pixels: (N,) rows and (N,) columns of the pixels.
            exposure: camera and scene of the picture.
            like: tensor whose dtype and device the result uses.
        """
        normal = like.new_tensor(_draws(exposure)[pixels])
        return lambda light: self._noisy(light, normal)

    def _noisy(self, light: Tensor, normal: Tensor) -> Tensor:
        """The light plus noise; `normal` holds standard normal draws of the same shape."""
        variance = light * (self.shot_noise / 100) ** 2 + (self.read_noise / 100) ** 2
        # The square root has no finite gradient at 0.
        return light + variance.clamp_min(1e-12).sqrt() * normal


def _draws(exposure: Exposure) -> FloatImage:
    """(H, W, 3) float32 standard normal numbers of this sample and camera."""
    camera, scene = exposure.camera, exposure.scene
    rng = derive_rng(scene.seed, "camera", scene.index, camera.name)
    return rng.standard_normal((camera.height_px, camera.width_px, 3), dtype=np.float32)
