"""From float maps to textures: colour spaces, normal and occlusion maps from heights."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from authoring.materials.noise import wrapped_blur

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.uint8]
# Small grain is no pit: the colour texture already contains its shadows.
GRAIN_M = 0.0005


def linear_to_srgb(linear: npt.ArrayLike) -> Image:
    """Linear albedo 0..1 as sRGB bytes."""
    value = np.clip(np.asarray(linear, np.float64), 0, 1)
    return to_bytes(np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 1e-9) ** (1 / 2.4) - 0.055))


def to_bytes(unit: npt.ArrayLike) -> Image:
    """Values 0..1 as bytes."""
    return np.clip(np.rint(np.asarray(unit, np.float64) * 255), 0, 255).astype(np.uint8)


def normal_from_height(height_m: Array, size_m: tuple[float, float]) -> Image:
    """Normal map of a tileable height field (H, W), row 0 at the top, that covers `size_m` (w, h)."""
    rows, columns = height_m.shape
    slope_u = (np.roll(height_m, -1, 1) - np.roll(height_m, 1, 1)) / (2 * size_m[0] / columns)
    slope_v = (np.roll(height_m, 1, 0) - np.roll(height_m, -1, 0)) / (2 * size_m[1] / rows)
    return normal_from_slopes(slope_u, slope_v)


def normal_from_slopes(slope_u: Array, slope_v: Array) -> Image:
    """Encodes every normal map of the town: red leans to the right of the texture, green up.

    Args:
        slope_u: (H, W) rise to the right in the texture, metres a metre.
        slope_v: (H, W) rise upwards in the texture.
    """
    normal = np.stack([-slope_u, -slope_v, np.ones_like(slope_u)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return to_bytes(normal * 0.5 + 0.5)


def open_sky(height_m: Array, tile_m: float, *, reach_m: float = 0.015, strength: float = 3.0) -> Array:
    """Occlusion (H, W) of a tileable height field: 1 on what stands out, less in joints and pits.

    Args:
        height_m: (H, W).
        tile_m: side of the square that it covers.
        reach_m: how wide around a pixel the surface is that its depth is measured against.
        strength: how quickly it gets dark with that depth; 1 halves the light at a depth of `reach_m`.
    """
    deep_m = wrapped_blur(height_m, reach_m / tile_m * height_m.shape[1]) - height_m
    return np.asarray(1 / (1 + strength * np.clip(deep_m - GRAIN_M, 0, None) / reach_m))


def rough(mean: float, variation: Array) -> Array:
    """Roughness (H, W) around a mean: what the variation adds to it anywhere is taken off everywhere."""
    return np.asarray(np.clip(mean + variation - variation.mean(), 0.05, 1.0))


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
