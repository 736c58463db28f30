"""From float maps to texture files: colour spaces, normal maps from heights, small PNGs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]


def linear_to_srgb(linear: npt.ArrayLike) -> Image:
    """Linear albedo 0..1 as sRGB bytes."""
    value = np.clip(np.asarray(linear, np.float64), 0, 1)
    return to_bytes(np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055))


def to_bytes(unit: npt.ArrayLike) -> Image:
    """Values 0..1 as bytes."""
    return np.clip(np.rint(np.asarray(unit, np.float64) * 255), 0, 255).astype(np.uint8)


def normal_from_height(height_m: Array, size_m: tuple[float, float]) -> Image:
    """Tangent-space normal map (x right, y up, z out) of a tileable height field (H, W) that covers `size_m` (w, h)."""
    rows, columns = height_m.shape
    slope_x = (np.roll(height_m, -1, 1) - np.roll(height_m, 1, 1)) / (2 * size_m[0] / columns)
    slope_up = (np.roll(height_m, 1, 0) - np.roll(height_m, -1, 0)) / (2 * size_m[1] / rows)
    normal = np.stack([-slope_x, -slope_up, np.ones_like(height_m)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return to_bytes(normal * 0.5 + 0.5)


def orm(occlusion: npt.ArrayLike, roughness: npt.ArrayLike, metallic: npt.ArrayLike) -> Image:
    """Occlusion, roughness and metalness (each (H, W) or a number) as one texture."""
    return to_bytes(np.stack(np.broadcast_arrays(occlusion, roughness, metallic), -1))


def shrunk(image: Image, largest_px: int) -> Image:
    """Averages whole blocks of pixels until neither side is longer than `largest_px`."""
    factor = -(-max(image.shape[:2]) // largest_px)
    height, width = image.shape[0] // factor, image.shape[1] // factor
    blocks = image[: height * factor, : width * factor].reshape(height, factor, width, factor, -1)
    small: Image = np.rint(blocks.mean((1, 3))).astype(np.uint8)
    return small


def write_png(path: Path, image: Image, *, colours: int | None = None) -> None:
    """Write (H, W, 3) as PNG; with `colours` as a palette image of so many, a third of the size for noise."""
    picture = PillowImage.fromarray(image)
    if colours is not None:
        picture = picture.quantize(colours, method=PillowImage.Quantize.MEDIANCUT, dither=PillowImage.Dither.NONE)
    picture.save(path, optimize=True)
