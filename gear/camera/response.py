"""The response of the camera: exposure and tone curve, the same for every pixel of every picture of a weather.

For light x in 0..1 (1 is the frame's full scale):

    y = x g / (1 + (g - 1) x)       exposure: shadows are lifted g times, full scale stays where it is
    z = y ^ c                       contrast: c > 1 draws blacks down
    picture = sRGB(z)               the encoding that every reader of PNG files expects

The curve rises everywhere and meets 0 and 1, so nothing clips that the frame has not clipped, and it can be undone.
Nothing in it depends on the picture: a patch cannot change how the rest of a scene is shown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from gear.values.frames import LINEAR_FULL_SCALE, UInt8Image, UInt16Image
from gear.values.scene import Weather

Encoding = Literal["srgb", "none"]
Floats = npt.NDArray[np.float64]

DISPLAY_POWER = 1 / 2.2
"""Display values grow with this power of light."""


@dataclass(frozen=True, slots=True)
class Response:
    """One camera setting.

    Attributes:
        exposure: gain in the shadows, more than 0; below 1 it darkens.
        contrast: exponent of the tone curve, 0.5 to 2.
        encoding: `none` for frames that hold display values already.
    """

    exposure: float = 1.0
    contrast: float = 1.0
    encoding: Encoding = "srgb"
    _table: UInt8Image = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not 0 < self.exposure < math.inf:
            raise ValueError(f"exposure must be more than 0, got {self.exposure}")
        if not 0.5 <= self.contrast <= 2:
            raise ValueError(f"contrast must be 0.5 to 2, got {self.contrast}")
        light = np.arange(LINEAR_FULL_SCALE + 1) / LINEAR_FULL_SCALE
        table = np.floor(self.curve(light) * 255 + 0.5).astype(np.uint8)
        table.setflags(write=False)
        object.__setattr__(self, "_table", table)

    def apply(self, linear_rgb: UInt16Image) -> UInt8Image:
        """The picture of a frame.

        Args:
            linear_rgb: (..., 3) uint16, 0..`LINEAR_FULL_SCALE`.

        Returns:
            (..., 3) uint8, a new array.
        """
        return np.asarray(self._table[linear_rgb])

    def curve(self, light: npt.ArrayLike) -> Floats:
        """The same without steps: light 0..1 to picture values 0..1, elementwise."""
        x = np.asarray(light, dtype=np.float64)
        y = x * self.exposure / (1 + (self.exposure - 1) * x)
        z = y**self.contrast
        return encode_srgb(z) if self.encoding == "srgb" else z

    def inverse(self, picture: npt.ArrayLike) -> Floats:
        """Picture values 0..1 back to light 0..1, elementwise."""
        value = np.asarray(picture, dtype=np.float64)
        z = decode_srgb(value) if self.encoding == "srgb" else value
        y = z ** (1 / self.contrast)
        return np.asarray(y / (self.exposure - (self.exposure - 1) * y))


IDENTITY = Response(encoding="none")
"""For frames that hold display values: the picture is the frame."""


def response_for(renderer_name: str, weather: Weather) -> Response:
    """The camera setting for a renderer's frames in a weather: fixed, as if set once by hand for that light.

    A low sun leaves streets in shadow and needs more lift; under clouds contrast is low by itself and gets a little
    more.
    """
    if renderer_name == "classic":
        return IDENTITY
    low_sun = float(np.clip((40 - weather.sun_altitude_deg) / 30, 0, 1))
    clouds = weather.exposure_cover
    exposure = 4.5 + 1.2 * low_sun - 2.0 * clouds
    return Response(exposure=round(exposure, 3), contrast=round(1.43 + 0.05 * clouds, 3))


def face_light(renderer_name: str, face: UInt8Image) -> Floats:
    """What a face's bytes weigh in a linear frame: I = B + w (W - B), with W and B seen with a white and a black face.

    Filament decodes a face from sRGB to albedo; classic lights its display values.

    Args:
        renderer_name: who renders.
        face: (...) uint8.

    Returns:
        (...) float64 in 0..1.
    """
    values = np.asarray(face, dtype=np.float64) / 255
    return values if renderer_name == "classic" else decode_srgb(values)


def encode_srgb(light: npt.ArrayLike) -> Floats:
    """Linear light 0..1 to sRGB values 0..1, elementwise."""
    x = np.asarray(light, dtype=np.float64)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)


def decode_srgb(values: npt.ArrayLike) -> Floats:
    """sRGB values 0..1 to linear light 0..1, elementwise."""
    v = np.asarray(values, dtype=np.float64)
    return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4)
