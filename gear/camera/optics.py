"""The camera's optional effects: motion blur, lens, vignette and noise, in this order, all in linear light."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
import numpy.typing as npt

from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.geometry import Array
from gear.values.optics import Lens
from gear.values.scene import CameraRecord, Vec3

BLUR_STEPS = 9
"""Moments of the shutter that are averaged; the middle one is the moment of the ground truth."""

_NEWTON_STEPS = 12


@dataclass(frozen=True, slots=True, eq=False)
class LensMap:
    """Where each pixel of a distorted picture comes from in the pinhole's.

    Attributes:
        x, y: (H, W) float32 index pixels of the pinhole picture.
        focal_px: of the distorted picture: the lens's own, so that it is filled to its corners.
    """

    x: FloatImage
    y: FloatImage
    focal_px: float


@lru_cache(maxsize=8)
def lens_map(lens: Lens, width_px: int, height_px: int, focal_px: float) -> LensMap:
    """The map of a lens before a pinhole of that size.

    The distorted picture has a longer focal length where it would otherwise show what the pinhole does not see.

    Raises:
        ValueError: the distortion folds the picture over.
    """
    low, high = 0.2, 1.0
    if _fits(lens, width_px, height_px, focal_px, high):
        low = high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if _fits(lens, width_px, height_px, focal_px, middle) else (low, middle)
    centre = np.array([(width_px - 1) / 2, (height_px - 1) / 2])
    x, y = np.meshgrid(np.arange(width_px) - centre[0], np.arange(height_px) - centre[1])
    seen = undistorted(lens, np.stack([x, y], axis=-1) * (low / focal_px)) * focal_px + centre
    seen = np.clip(seen, 0, np.array([width_px - 1, height_px - 1]))
    maps = [np.ascontiguousarray(seen[..., axis], dtype=np.float32) for axis in (0, 1)]
    for one in maps:
        one.setflags(write=False)
    return LensMap(maps[0], maps[1], round(focal_px / low, 6))


def undistorted(lens: Lens, distorted: Array) -> Array:
    """(..., 2) points behind the lens to where a pinhole sees them, both in focal lengths.

    Raises:
        ValueError: the distortion folds the picture over there.
    """
    wanted = np.linalg.norm(distorted, axis=-1)
    radius = wanted.copy()
    for _ in range(_NEWTON_STEPS):
        square = radius**2
        slope = 1 + 3 * lens.k1 * square + 5 * lens.k2 * square**2
        if bool((slope < 0.05).any()):
            raise ValueError(f"a lens of k1 {lens.k1:g} and k2 {lens.k2:g} folds so wide a picture over")
        radius -= (radius * (1 + lens.k1 * square + lens.k2 * square**2) - wanted) / slope
    return np.asarray(distorted * (radius / np.maximum(wanted, 1e-12))[..., None])


def _fits(lens: Lens, width_px: int, height_px: int, focal_px: float, zoom: float) -> bool:
    """Whether the border of the distorted picture lies in the pinhole's."""
    half = np.array([(width_px - 1) / 2, (height_px - 1) / 2])
    ticks = np.linspace(-1, 1, 65)
    one = np.ones_like(ticks)
    border = np.concatenate([np.column_stack(pair) for pair in ((ticks, one), (one, ticks))]) * half
    try:
        seen = undistorted(lens, border * (zoom / focal_px)) * focal_px
    except ValueError:
        return False
    return bool((np.abs(seen) <= half + 1e-6).all())


def through_lens(raw: RawView, camera: CameraRecord, lens: Lens) -> RawView:
    """Colour, depth and ids by one map: colour bilinear in linear light, truth from the nearest pixel."""
    found = lens_map(lens, camera.width_px, camera.height_px, camera.focal_px)
    assert raw.linear_rgb is not None
    row, column = np.rint(found.y).astype(np.intp), np.rint(found.x).astype(np.intp)
    return RawView(
        linear_rgb=np.asarray(cv2.remap(raw.linear_rgb, found.x, found.y, cv2.INTER_LINEAR), dtype=np.uint16),
        depth_m=raw.depth_m[row, column],
        geom_id=raw.geom_id[row, column],
    )


@lru_cache(maxsize=8)
def vignette_map(strength: float, width_px: int, height_px: int) -> FloatImage:
    """(H, W) float32 shares of light: 1 in the middle, 1 - `strength` in the corners."""
    x, y = np.meshgrid(np.linspace(-1, 1, width_px), np.linspace(-1, 1, height_px))
    aspect = height_px / width_px
    square = (x**2 + (aspect * y) ** 2) / (1 + aspect**2)
    # A lens dims by the fourth power of a cosine, 1 / (1 + r²)².
    share = (1 / (1 + ((1 - strength) ** -0.5 - 1) * square) ** 2).astype(np.float32)
    share.setflags(write=False)
    return np.asarray(share)


def vignetted(linear_rgb: UInt16Image, strength: float) -> UInt16Image:
    """A frame with darker corners, rounded."""
    share = vignette_map(strength, linear_rgb.shape[1], linear_rgb.shape[0])
    return np.asarray(cv2.multiply(linear_rgb, cv2.merge([share, share, share]), dtype=cv2.CV_16U), dtype=np.uint16)


def motion_blurred(
    linear_rgb: UInt16Image, depth_m: FloatImage, camera: CameraRecord, velocity_world_mps: Vec3, shutter_s: float
) -> UInt16Image:
    """What a shutter that is open for a while around the truth's moment gathers.

    Each pixel is the mean along the way that its point takes over the picture while the ego car drives; other road
    users are taken for standing, turning is left out, and the sky stays. The way follows from depth alone.
    """
    velocity = camera.world_from_camera_transform.rotation.T @ np.asarray(velocity_world_mps)
    inverse = np.nan_to_num(1 / depth_m, nan=0.0).astype(np.float32)
    x, y = np.meshgrid(
        np.arange(camera.width_px, dtype=np.float32) - np.float32((camera.width_px - 1) / 2),
        np.arange(camera.height_px, dtype=np.float32) - np.float32((camera.height_px - 1) / 2),
    )
    total = np.zeros(linear_rgb.shape, np.float32)
    for moment in np.linspace(-0.5, 0.5, BLUR_STEPS):
        shift = (velocity * moment * shutter_s).astype(np.float32)
        scale = 1 / np.maximum(1 - shift[2] * inverse, np.float32(0.1))
        from_x = (x - np.float32(camera.focal_px) * shift[0] * inverse) * scale
        from_y = (y - np.float32(camera.focal_px) * shift[1] * inverse) * scale
        from_x += np.float32((camera.width_px - 1) / 2)
        from_y += np.float32((camera.height_px - 1) / 2)
        total += cv2.remap(linear_rgb, from_x, from_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(total / np.float32(BLUR_STEPS) + np.float32(0.5), dtype=np.uint16)


def noisy(linear_rgb: UInt16Image, shot: float, read: float, rng: np.random.Generator) -> UInt16Image:
    """A frame with noise of Gaussian shape.

    Args:
        linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
        shot, read: standard deviations in percent of full scale, at full scale and in the dark.
        rng: of this sample and camera. It draws the same for every frame: twins have the same grain.
    """
    light = linear_rgb.astype(np.float32)
    variance = light * np.float32((shot / 100) ** 2 * LINEAR_FULL_SCALE)
    variance += np.float32((read / 100 * LINEAR_FULL_SCALE) ** 2)
    light += np.sqrt(variance) * rng.standard_normal(light.shape, dtype=np.float32)
    clipped: npt.NDArray[np.float32] = np.clip(light + np.float32(0.5), 0, LINEAR_FULL_SCALE)
    return clipped.astype(np.uint16)
