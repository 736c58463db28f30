"""Feature squeezing: fewer bits per channel (Xu et al., NDSS 2018)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import Mask, PerPicture, each_as_uint8, straight_through
from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class BitDepthConfig:
    """Options of bit-depth reduction.

    Attributes:
        bits: bits per channel, 1 to 7.
    """

    bits: int = 4

    def __post_init__(self) -> None:
        if not 1 <= self.bits <= 7:
            raise FieldError("bits", f"must be 1 to 7, got {self.bits}")


class BitDepth(PerPicture):
    """A defense that rounds each value to the nearest of 2^bits evenly spaced levels.

    Args:
        config: options of the defense.
    """

    def __init__(self, config: BitDepthConfig) -> None:
        steps = 2**config.bits - 1
        self._table = np.rint(np.rint(np.arange(256) / 255 * steps) / steps * 255).astype(np.uint8)

    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Returns the picture with fewer bits per channel, and None instead of a mask.

        Args:
            picture: (H, W, 3) uint8 sRGB.
        """
        return self._table[picture], None

    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Returns the pictures with fewer bits per channel; the gradient is that of the identity (BPDA).

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        return straight_through(pictures, each_as_uint8(pictures, lambda picture: self._table[picture]))


spec = DefenseSpec(
    name="bit_depth",
    summary="Feature squeezing: fewer bits per colour channel.",
    config=BitDepthConfig,
    build=BitDepth,
    gradient="surrogate",
)


@hookimpl
def gear_defenses() -> list[DefenseSpec[BitDepthConfig]]:
    """Hook of the plugin system: returns the defense plugin that this module defines."""
    return [spec]
