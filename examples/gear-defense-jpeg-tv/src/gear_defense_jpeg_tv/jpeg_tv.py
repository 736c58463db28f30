"""JPEG, then Chambolle's dual projection for total variation (JMIV 20, 2004), all colours jointly."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
import numpy.typing as npt
from gear.plugins.defenses.per_picture import Mask, PerPicture, each_as_uint8, straight_through
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

    from gear_defense_jpeg_tv import JpegTvConfig

Levels = npt.NDArray[np.float32]
STEP = 0.125
"""The largest step for which Chambolle proves convergence."""


class JpegTv(PerPicture):
    """Compresses and decompresses a picture, then smooths it except for strong edges."""

    def __init__(self, config: JpegTvConfig) -> None:
        self.config = config

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """The cleaned (H, W, 3) uint8 picture, and None for no mask."""
        return self._clean(picture), None

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """The same values, with the identity as substitute gradient."""
        return straight_through(pictures, each_as_uint8(pictures, self._clean))

    def _clean(self, picture: UInt8Image) -> UInt8Image:
        parameters = [cv2.IMWRITE_JPEG_QUALITY, self.config.quality]
        data = cv2.imencode(".jpg", np.ascontiguousarray(picture[..., ::-1]), parameters)[1]
        decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
        assert decoded is not None  # it was encoded a line above
        smooth = denoised(decoded[..., ::-1].astype(np.float32), self.config.weight_levels, self.config.iterations)
        levels: UInt8Image = np.rint(np.clip(smooth, 0, 255)).astype(np.uint8)
        return levels


def denoised(picture: Levels, weight: float, iterations: int) -> Levels:
    """The (H, W, C) picture u that minimises |u - picture|^2 / (2 weight) + TV(u)."""
    dual = np.zeros((2, *picture.shape), np.float32)
    for _ in range(iterations):
        slope = gradient(divergence(dual) - picture / weight)
        length = np.sqrt((slope**2).sum(axis=(0, 3), keepdims=True))
        dual = (dual + STEP * slope) / (1 + STEP * length)
    smooth: Levels = picture - weight * divergence(dual)
    return smooth


def gradient(picture: Levels) -> Levels:
    """(2, H, W, C) differences to the next row and the next column, 0 at the border."""
    slope = np.zeros((2, *picture.shape), np.float32)
    slope[0, :-1] = picture[1:] - picture[:-1]
    slope[1, :, :-1] = picture[:, 1:] - picture[:, :-1]
    return slope


def divergence(dual: Levels) -> Levels:
    """The negative adjoint of `gradient`."""
    result = np.zeros(dual.shape[1:], np.float32)
    result[:-1] += dual[0, :-1]
    result[1:] -= dual[0, :-1]
    result[:, :-1] += dual[1, :, :-1]
    result[:, 1:] -= dual[1, :, :-1]
    return result
