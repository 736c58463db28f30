"""A defense that compresses every picture with JPEG (Dziugaite et al., 2016)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import Mask, PerPicture, each_as_uint8, straight_through
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class JpegConfig:
    """Options of JPEG compression.

    Attributes:
        quality: libjpeg's quality, 1 to 100.
    """

    quality: int = 50

    def __post_init__(self) -> None:
        if not 1 <= self.quality <= 100:
            raise FieldError("quality", f"must be 1 to 100, got {self.quality}")


class Jpeg(PerPicture):
    """A defense that compresses and decompresses every picture.

    Args:
        config: options of the defense.
    """

    def __init__(self, config: JpegConfig) -> None:
        self._parameters = [cv2.IMWRITE_JPEG_QUALITY, config.quality]

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Returns the picture after JPEG compression, and None instead of a mask.

        Args:
            picture: (H, W, 3) uint8 sRGB.
        """
        return self._recode(picture), None

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Returns the pictures after JPEG compression; the gradient is that of the identity (BPDA).

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        return straight_through(pictures, each_as_uint8(pictures, self._recode))

    def _recode(self, picture: UInt8Image) -> UInt8Image:
        _, data = cv2.imencode(".jpg", picture[..., ::-1], self._parameters)
        decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
        assert decoded is not None  # the data were encoded just above, so decoding succeeds
        return np.ascontiguousarray(decoded[..., ::-1], np.uint8)


spec = DefenseSpec(
    name="jpeg",
    summary="JPEG compression of every picture.",
    config=JpegConfig,
    build=Jpeg,
    gradient="surrogate",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[JpegConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
