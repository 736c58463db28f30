"""The response of the camera: exposure and tone curve. It is the same for all pixels of all pictures of a weather.

For light x in 0..1 (1 is the frame's full scale):

    y = x g / (1 + (g - 1) x)       exposure: the darkest values are multiplied by g, full scale is unchanged
    z = y ^ c                       contrast: c > 1 darkens dark values
    picture = sRGB(z)               the encoding that readers of PNG files expect

The curve increases strictly from 0 to 1, so it clips nothing and can be inverted. It does not depend on the content of
the picture, so a patch cannot change the brightness of other parts of the scene.
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

_UINT16_VALUES = 1 << 16

DISPLAY_POWER = 1 / 2.2
"""Exponent from light to display values, for frames that hold display values (the classic renderer)."""


@dataclass(frozen=True, slots=True)
class Response:
    """The response of a camera: exposure and tone curve.

    Attributes:
        exposure: gain g of the darkest values, above 0; a gain below 1 darkens the picture.
        contrast: exponent c of the tone curve, 0.5 to 2.
        encoding: `srgb`, or `none` for frames that already hold display values.

    Raises:
        ValueError: a parameter is out of range.
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
        # OpenCV's tables have an entry for every value of uint16, and are read ten times as fast as with NumPy's index.
        table = np.full(_UINT16_VALUES, 255, np.uint8)
        table[: LINEAR_FULL_SCALE + 1] = np.floor(self.curve(light) * 255 + 0.5)
        table.setflags(write=False)
        object.__setattr__(self, "_table", table)

    def apply(self, linear_rgb: UInt16Image) -> UInt8Image:
        """Converts a linear frame to an 8-bit picture.

        Args:
            linear_rgb: (..., 3) uint16, 0..`LINEAR_FULL_SCALE`.

        Returns:
            (..., 3) uint8 picture, a new array.
        """
        if not linear_rgb.size:
            return np.zeros(linear_rgb.shape, np.uint8)
        row = np.ascontiguousarray(linear_rgb).reshape(1, -1)
        import cv2  # here, because configs import this module and need no OpenCV

        return np.asarray(cv2.LUT(row, self._table[None]), np.uint8).reshape(linear_rgb.shape)

    def curve(self, light: npt.ArrayLike) -> Floats:
        """Converts light to picture values 0..1 without rounding, by the formulas of exposure, contrast and
        encoding.

        Args:
            light: linear light in 0..1, any shape; 1 is the frame's full scale.

        Returns:
            Values in the shape of `light`, float64.
        """
        x = np.asarray(light, dtype=np.float64)
        y = x * self.exposure / (1 + (self.exposure - 1) * x)
        z = y**self.contrast
        return encode_srgb(z) if self.encoding == "srgb" else z

    def inverse(self, picture: npt.ArrayLike) -> Floats:
        """Converts picture values back to light 0..1, the inverse of `curve`.

        Args:
            picture: picture values in 0..1, any shape.

        Returns:
            Light in the shape of `picture`, float64.
        """
        value = np.asarray(picture, dtype=np.float64)
        z = decode_srgb(value) if self.encoding == "srgb" else value
        y = z ** (1 / self.contrast)
        return np.asarray(y / (self.exposure - (self.exposure - 1) * y))


IDENTITY = Response(encoding="none")
"""The response for frames that hold display values: the picture equals the frame."""


def response_for(renderer_name: str, weather: Weather) -> Response:
    """Returns the response that belongs to a renderer and a weather; `IDENTITY` for `classic`, whose frames
    already hold display values.

    When the sun is low, streets lie in shadow and the exposure is raised. Under clouds the exposure is lower. Clouds
    also lower the contrast of light, so the tone curve adds contrast.

    Args:
        renderer_name: name of the renderer.
        weather: the weather, for the sun's altitude and the clouds.
    """
    if renderer_name == "classic":
        return IDENTITY
    low_sun = float(np.clip((40 - weather.sun_altitude_deg) / 30, 0, 1))
    clouds = weather.exposure_cover
    exposure = 4.5 + 1.2 * low_sun - 2.0 * clouds
    return Response(exposure=round(exposure, 3), contrast=round(1.43 + 0.05 * clouds, 3))


def face_light(renderer_name: str, face: UInt8Image) -> Floats:
    """Converts the bytes of a face's texture (a patch) to the weights w by which frames are composed.

    A frame that shows the face is I = B + w (W - B), where B and W are the frames with a black and a white face. The
    classic renderer computes light with display values, so w is the byte / 255. All other renderers decode sRGB, so w
    is the albedo.

    Args:
        renderer_name: name of the renderer.
        face: (...) uint8 picture of the face.

    Returns:
        (...) float64 weights w in 0..1.
    """
    values = np.asarray(face, dtype=np.float64) / 255
    return values if renderer_name == "classic" else decode_srgb(values)


def encode_srgb(light: npt.ArrayLike) -> Floats:
    """Converts linear light to sRGB values 0..1, elementwise.

    Args:
        light: linear light in 0..1, any shape.
    """
    x = np.asarray(light, dtype=np.float64)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * np.maximum(x, 0.0031308) ** (1 / 2.4) - 0.055)


def decode_srgb(values: npt.ArrayLike) -> Floats:
    """Converts sRGB values to linear light 0..1, elementwise.

    Args:
        values: sRGB values in 0..1, any shape.
    """
    v = np.asarray(values, dtype=np.float64)
    return np.where(v <= 0.04045, v / 12.92, ((np.maximum(v, 0.04045) + 0.055) / 1.055) ** 2.4)
