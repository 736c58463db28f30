"""Random changes of pixel values, as by a camera, an encoder or dirt. Pixels are not moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from gear.values.errors import FieldError
from gear.values.frames import UInt8Image

LEVELS = np.arange(256, dtype=np.float32) / 255
MOST_BLUR_PX = 100.0
"""Upper limit of the option `blur_px`, the standard deviation of the blur in pixels; a larger blur would take too
long.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Colours:
    """Strengths of the colour changes. Every change is drawn uniformly from its range, gamma in its logarithm.

    Attributes:
        brightness: pixel values are scaled by 1 ± this.
        contrast: the difference from middle grey is scaled by 1 ± this.
        saturation: the difference from the pixel's grey level is scaled by 1 ± this.
        balance: each of red, green, blue is scaled by 1 ± this.
        gamma: exponent between 1 / (1 + this) and 1 + this.
        noise: probability that noise is added.
        noise_levels: largest standard deviation of the noise, in levels of 0..255.
        blur: probability that the picture is blurred.
        blur_px: largest standard deviation of the blur.
        jpeg: probability that the picture is compressed by JPEG.
        jpeg_quality: lowest quality of JPEG, 1 to 100.
        erase: probability that a rectangle is filled with noise; ground truth does not change.
        erase_share: largest sides of the rectangle, as a share of the picture's sides.
    """

    brightness: float = 0.3
    contrast: float = 0.3
    saturation: float = 0.3
    balance: float = 0.06
    gamma: float = 0.3
    noise: float = 0.25
    noise_levels: float = 8.0
    blur: float = 0.15
    blur_px: float = 1.2
    jpeg: float = 0.15
    jpeg_quality: int = 40
    erase: float = 0.0
    erase_share: float = 0.3

    def __post_init__(self) -> None:
        for name in ("brightness", "contrast", "saturation", "balance"):
            if not 0 <= getattr(self, name) < 1:
                raise FieldError(name, f"must be 0 or more and below 1, got {getattr(self, name):g}")
        for name in ("noise", "blur", "jpeg", "erase", "erase_share"):
            if not 0 <= getattr(self, name) <= 1:
                raise FieldError(name, f"must be 0 to 1, got {getattr(self, name):g}")
        for name in ("gamma", "noise_levels", "blur_px"):
            if getattr(self, name) < 0:
                raise FieldError(name, f"must not be negative, got {getattr(self, name):g}")
        if self.blur_px > MOST_BLUR_PX:
            raise FieldError("blur_px", f"must be at most {MOST_BLUR_PX:g}, got {self.blur_px:g}")
        if not 1 <= self.jpeg_quality <= 100:
            raise FieldError("jpeg_quality", f"must be 1 to 100, got {self.jpeg_quality}")


def recolour(images: Mapping[str, UInt8Image], colours: Colours, rng: np.random.Generator) -> dict[str, UInt8Image]:
    """Returns recoloured copies of the pictures of one sample, by camera name.

    All views are changed in the same way; only the noise differs between views.

    Args:
        images: (H, W, 3) uint8 pictures by camera name.
        colours: strengths of the colour changes.
        rng: generator of all random draws.
    """
    table, saturation = _table(colours, rng), 1 + rng.uniform(-colours.saturation, colours.saturation)
    blur_px = rng.uniform(min(0.3, colours.blur_px), colours.blur_px) if rng.random() < colours.blur else 0.0
    noise_levels = rng.uniform(0, colours.noise_levels) if rng.random() < colours.noise else 0.0
    quality = int(rng.integers(colours.jpeg_quality, 101)) if rng.random() < colours.jpeg else 0
    erased = rng.uniform(0, 1, 4) if rng.random() < colours.erase else None
    result = {}
    for name, picture in images.items():
        changed = cv2.LUT(picture, table)
        grey = cv2.cvtColor(cv2.cvtColor(changed, cv2.COLOR_RGB2GRAY), cv2.COLOR_GRAY2RGB)
        changed = cv2.addWeighted(changed, saturation, grey, 1 - saturation, 0)
        if blur_px:
            changed = cv2.GaussianBlur(changed, (0, 0), blur_px)
        if noise_levels:
            noise = rng.standard_normal(changed.shape, dtype=np.float32) * np.float32(noise_levels)
            changed = np.clip(np.rint(changed + noise), 0, 255).astype(np.uint8)
        if erased is not None:
            changed = _erase(np.asarray(changed, dtype=np.uint8), erased, colours.erase_share, rng)
        if quality:
            changed = _through_jpeg(np.asarray(changed, dtype=np.uint8), quality)
        result[name] = np.asarray(changed, dtype=np.uint8)
    return result


def _through_jpeg(picture: UInt8Image, quality: int) -> UInt8Image:
    _, data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    decoded = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    return np.ascontiguousarray(decoded[..., ::-1])


def _table(colours: Colours, rng: np.random.Generator) -> UInt8Image:
    """(1, 256, 3) table of levels: gamma, then brightness and balance, then contrast."""
    reach = np.log1p(colours.gamma)
    shaped = LEVELS ** np.exp(rng.uniform(-reach, reach))
    gain = (1 + rng.uniform(-colours.brightness, colours.brightness)) * (
        1 + rng.uniform(-colours.balance, colours.balance, 3)
    )
    contrast = 1 + rng.uniform(-colours.contrast, colours.contrast)
    values = (shaped[:, None] * gain - 0.5) * contrast + 0.5
    return np.asarray(np.rint(np.clip(values, 0, 1) * 255)[None], dtype=np.uint8)


def _erase(picture: UInt8Image, unit: np.ndarray, share: float, rng: np.random.Generator) -> UInt8Image:
    """Fills a rectangle, given by four numbers in 0..1, with noise (Zhong et al., "Random Erasing", 2020)."""
    height, width = picture.shape[:2]
    h, w = max(1, int(height * share * unit[0])), max(1, int(width * share * unit[1]))
    top, left = int((height - h) * unit[2]), int((width - w) * unit[3])
    painted = picture.copy()
    painted[top : top + h, left : left + w] = rng.integers(0, 256, (h, w, 3), dtype=np.uint8)
    return painted
