"""Motion blur: objects are smeared in the picture, because the ego car drives while the shutter is open."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from gear.camera.effects.effect import Effect, Exposure, PixelSamples
from gear.camera.effects.sampling import read_bilinear
from gear.contracts.rendering import RawView
from gear.values.errors import FieldError
from gear.values.frames import FloatImage

if TYPE_CHECKING:
    from torch import Tensor

Real = TypeVar("Real", np.float32, np.float64)

MOMENTS = 9
"""Number of moments, evenly spaced while the shutter is open, whose pictures are averaged. Ground truth belongs to the
middle moment.
"""

_LEAST_DENOMINATOR = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionBlur(Effect):
    """Blur by the ego car's motion. Each pixel is the mean of the picture along the path of the pixel's scene point.

    The path is computed from depth and the ego car's velocity. Other road users are treated as if they stood still, and
    rotation is neglected. The sky and the ego car's own bonnet stay sharp.

    Attributes:
        shutter_s: exposure time in seconds, 0 to 0.1; 0 switches the blur off.
    """

    ORDER: ClassVar[int] = 10

    shutter_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.shutter_s <= 0.1:
            raise FieldError("shutter_s", f"must be 0 to 0.1 s, got {self.shutter_s:g}")

    @property
    def is_active(self) -> bool:
        """Whether the blur is on: the exposure time is above 0."""
        return self.shutter_s > 0

    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """Blurs the colour of a view and rounds it. Depth and ids are not blurred: they belong to the middle
        moment of
        the exposure.

        Args:
            view: the sharp view, with colour.
            exposure: camera and scene of the picture, for the ego car's velocity.
        """
        import cv2  # not at the top: configs are read without OpenCV

        assert view.linear_rgb is not None
        total = np.zeros(view.linear_rgb.shape, np.float32)
        for from_x, from_y in self._paths(view, exposure):
            total += cv2.remap(view.linear_rgb, from_x, from_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return replace(view, linear_rgb=np.asarray(total / np.float32(MOMENTS) + np.float32(0.5), dtype=np.uint16))

    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """Blurs (B, 3, H, W) linear light in torch, differentiable and without rounding.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of the picture; its colour is not used.
            exposure: camera and scene of the picture.
        """
        total = light * 0
        for from_x, from_y in self._paths(truth, exposure):
            total = total + read_bilinear(light, from_x.astype(np.float64), from_y.astype(np.float64))
        return total / MOMENTS

    def trace(self, samples: PixelSamples, exposure: Exposure) -> PixelSamples:
        """Replaces (N, S) samples of the blurred picture by the (N, 9 S) samples of the sharp picture that are
        averaged
        (`MOMENTS` = 9).

        Args:
            samples: pixels of the blurred picture.
            exposure: camera and scene of the picture.
        """
        pinhole = exposure.camera.intrinsics
        inverse = np.maximum(samples.inverse_depth(samples.x, samples.y), 0.0)
        xs, ys = [], []
        for shift in self._shifts(exposure):
            x, y = _moved(samples.x - pinhole.cx_px, samples.y - pinhole.cy_px, inverse, shift, exposure)
            xs.append(x + pinhole.cx_px)
            ys.append(y + pinhole.cy_px)
        return replace(
            samples,
            x=np.concatenate(xs, axis=1),
            y=np.concatenate(ys, axis=1),
            weight=np.tile(samples.weight / MOMENTS, (1, MOMENTS)),
        )

    def _shifts(self, exposure: Exposure) -> Iterator[npt.NDArray[np.float64]]:
        """For each moment: (3,) displacement of the camera in metres from its position at the middle moment,
        camera frame.
        """
        rotation = exposure.camera.world_from_camera_transform.rotation
        velocity = rotation.T @ np.asarray(exposure.scene.ego.velocity_world_mps)
        for moment in np.linspace(-0.5, 0.5, MOMENTS):
            yield velocity * moment * self.shutter_s

    def _paths(self, truth: RawView, exposure: Exposure) -> Iterator[tuple[FloatImage, FloatImage]]:
        """For each moment: (H, W) float32 columns and rows of the sharp picture that the pixels read."""
        pinhole, depth_m = exposure.camera.intrinsics, truth.depth_m
        if exposure.geoms is not None:
            # The ego car's own parts move with the camera. With infinite depth they stay sharp.
            is_ego = np.append(exposure.geoms.object_id == exposure.scene.ego.id, False)[truth.geom_id]
            depth_m = np.where(is_ego, np.float32(np.inf), depth_m)
        inverse = np.nan_to_num(1 / depth_m, nan=0.0).astype(np.float32)
        x, y = np.meshgrid(
            np.arange(pinhole.width_px, dtype=np.float32) - np.float32(pinhole.cx_px),
            np.arange(pinhole.height_px, dtype=np.float32) - np.float32(pinhole.cy_px),
        )
        for shift in self._shifts(exposure):
            from_x, from_y = _moved(x, y, inverse, shift.astype(np.float32), exposure)
            from_x += np.float32(pinhole.cx_px)
            from_y += np.float32(pinhole.cy_px)
            yield from_x, from_y


def _moved(
    x: npt.NDArray[Real],
    y: npt.NDArray[Real],
    inverse_depth: npt.NDArray[Real],
    shift_m: npt.NDArray[Real],
    exposure: Exposure,
) -> tuple[npt.NDArray[Real], npt.NDArray[Real]]:
    """Where points appear in the picture of a shifted camera; x and y are relative to the principal point."""
    kind, pinhole = x.dtype.type, exposure.camera.intrinsics
    scale = 1 / np.maximum(1 - shift_m[2] * inverse_depth, kind(_LEAST_DENOMINATOR))
    from_x = (x - kind(pinhole.fx_px) * shift_m[0] * inverse_depth) * scale
    from_y = (y - kind(pinhole.fy_px) * shift_m[1] * inverse_depth) * scale
    return np.asarray(from_x), np.asarray(from_y)
