"""Ambient occlusion from depth: corners, kerbs and the ground under cars become darker than open surfaces.

Filament's own ambient occlusion is off, because with Mesa's software Vulkan (22.3) it leaks about a megabyte per frame.
The ambient occlusion of this module works for all renderers. It depends on depth alone, so frames stay linear in every
albedo.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage, UInt16Image

RADII_M = (0.2, 0.6)
STRENGTH = 0.55
_DIRECTIONS = 6
_COARSE_WIDTH_PX = 700
_BAND_ROWS = 64
_NEAREST = 2.5
"""Largest distance, in radii, by which a neighbour may lie in front of its pixel."""

_MAX_REACH = 0.06
"""Largest distance of samples from their pixel, as a share of the picture's width."""


def openness(depth_m: FloatImage, focal_px: float) -> FloatImage:
    """The ambient visibility of each pixel: the factor by which ambient occlusion reduces light.

    Each pixel is compared with pairs of opposite neighbours. On a plane 1/z is linear over the picture, so the mean of
    a pair lies on the plane, whatever its slant. If the mean is nearer than the pixel, the surface is concave there.
    Pairs with a neighbour that is more than a radius away are ignored: an object does not darken a distant wall behind
    it.

    Args:
        depth_m: (H, W) float32 planar z, NaN where nothing was hit.
        focal_px: horizontal focal length, pixels.

    Returns:
        (H, W) float32 factors in 1 - `STRENGTH`..1; 1 for open surfaces.
    """
    height, width = depth_m.shape
    step = max(1, math.ceil(width / _COARSE_WIDTH_PX))
    inverse = np.nan_to_num(1 / depth_m[step // 2 :: step, step // 2 :: step], nan=0.0).astype(np.float32)
    ticks = [np.arange(size, dtype=np.float32) for size in inverse.shape]
    columns, rows = np.meshgrid(ticks[1], ticks[0])
    hollow = np.zeros_like(inverse)
    for radius_m in RADII_M:
        reach = np.minimum(focal_px / step * radius_m * inverse, _MAX_REACH * inverse.shape[1]).astype(np.float32)
        # Neighbours closer than a pixel and a half would be interpolated from the pixel itself.
        counts = (reach > 1.5) & (inverse > 0)
        # Differences of 1/z over (1/z)² are metres along the view.
        radius = np.maximum(radius_m * inverse * inverse, np.float32(1e-9))
        scale, nearest = 1 / radius, inverse + np.float32(_NEAREST) * radius
        for turn in range(_DIRECTIONS):
            angle = math.pi * (turn + 0.5 * (radius_m == RADII_M[0])) / _DIRECTIONS
            across, down = reach * np.float32(math.cos(angle)), reach * np.float32(math.sin(angle))
            one, other = (
                cv2.remap(inverse, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
                for at in ((columns + across, rows + down), (columns - across, rows - down))
            )
            is_near = np.maximum(one, other) < nearest
            is_near &= counts
            # Twice the distance by which the mean of the pair lies in front of the pixel, in radii.
            bend = np.add(one, other, out=one)
            bend -= inverse
            bend -= inverse
            bend *= scale
            np.clip(bend, 0, 1, out=bend)
            bend *= is_near
            hollow += bend
    seen = 1 - np.float32(STRENGTH / (len(RADII_M) * _DIRECTIONS)) * hollow
    seen = cv2.blur(seen, (5, 5), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(seen, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def shade(linear_rgb: UInt16Image, share: npt.NDArray[np.float32]) -> UInt16Image:
    """Multiplies a linear frame by the share of the light that ambient occlusion leaves, with rounding.

    Args:
        linear_rgb: (H, W, 3) uint16 linear light.
        share: (H, W) float32 share of the light that is left, 0..1, from `openness`.

    Returns:
        (H, W, 3) uint16, a new array.
    """
    shaded = np.empty_like(linear_rgb)
    # In bands, since the shares of a whole picture, once for each colour, take more memory than the picture.
    for top in range(0, len(share), _BAND_ROWS):
        band = slice(top, top + _BAND_ROWS)
        cv2.multiply(linear_rgb[band], cv2.merge([share[band]] * 3), dst=shaded[band], dtype=cv2.CV_16U)
    return shaded
