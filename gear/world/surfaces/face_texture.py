"""Resamples a patch of any size to the size that the textures of all faces have.

Resampling averages areas in linear light. It is linear and treats rows and columns separately, so two small matrices
suffice: `face = rows @ patch @ columns.T` for each channel, with `rows = box_matrix(h, 600)` and `columns =
box_matrix(w, 1200)`. The compositors use the same two matrices in torch. If the texture's size is a multiple of the
patch's size, every pixel of the patch becomes a block of equal texels, exactly.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Literal

import numpy as np
import numpy.typing as npt

from gear.values.frames import UInt8Image
from gear.values.geometry import Array, frozen

FACE_SIZE_PX = (1200, 600)
"""Width and height of the texture of every face."""

SurfaceAlbedo = Literal["none", "white", "black"] | UInt8Image
"""The picture on a surface: "none" (its neutral texture), "white" (albedo 1), "black" (albedo 0), or a patch.

A patch is a (h, w, 3) uint8 sRGB picture.
"""

SurfaceAlbedos = Mapping[str, SurfaceAlbedo]
"""The picture on each surface, by the surface's name. Surfaces that are missing in the mapping have their neutral
texture.
"""


@lru_cache(maxsize=64)
def box_matrix(source_px: int, target_px: int) -> Array:
    """The matrix that resamples one axis by averaging areas.

    Target pixel i covers the interval [i, i + 1) * source / target of the source axis; its value is the mean over that
    interval.

    Args:
        source_px: number of pixels before resampling.
        target_px: number of pixels after resampling.

    Returns:
        (target_px, source_px) float64 matrix, read-only; each row sums to 1.
    """
    edges = np.arange(target_px + 1, dtype=np.float64) * source_px / target_px
    source = np.arange(source_px, dtype=np.float64)
    low = np.maximum(edges[:-1, None], source[None, :])
    high = np.minimum(edges[1:, None], source[None, :] + 1)
    weights = np.clip(high - low, 0.0, None)
    return frozen(weights / weights.sum(axis=1, keepdims=True))


def linear_from_srgb(srgb: npt.ArrayLike) -> Array:
    """Converts sRGB values in 0..1 to linear light in 0..1, elementwise (IEC 61966-2-1).

    Args:
        srgb: values of any shape.

    Returns:
        float64 of the same shape.
    """
    values = np.asarray(srgb, dtype=np.float64)
    return np.asarray(np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4))


def srgb_from_linear(linear: npt.ArrayLike) -> Array:
    """Converts linear light, clipped to 0..1, to sRGB values in 0..1, elementwise (IEC 61966-2-1).

    Args:
        linear: values of any shape.

    Returns:
        float64 of the same shape.
    """
    values = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.asarray(np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055))


LINEAR_FROM_BYTE = linear_from_srgb(np.arange(256) / 255)
"""(256,) float64: the linear light 0..1 of each sRGB byte."""


def resample_linear(linear: npt.ArrayLike, size_px: tuple[int, int] = FACE_SIZE_PX) -> Array:
    """Resamples a picture in linear light by averaging areas.

    Args:
        linear: (h, w, 3) linear light.
        size_px: width and height of the result.

    Returns:
        (size_px[1], size_px[0], 3) float64 linear light, a linear function of the input.
    """
    image = np.asarray(linear, dtype=np.float64)
    rows, columns = box_matrix(image.shape[0], size_px[1]), box_matrix(image.shape[1], size_px[0])
    return np.asarray(np.einsum("ih,hwc,jw->ijc", rows, image, columns, optimize=True))


def face_from_patch(patch: UInt8Image, size_px: tuple[int, int] = FACE_SIZE_PX) -> UInt8Image:
    """Resamples a patch to the size of a face's texture.

    Args:
        patch: (h, w, 3) uint8 sRGB, of any size.
        size_px: width and height of the texture.

    Returns:
        (size_px[1], size_px[0], 3) uint8 sRGB, read-only.

    Raises:
        ValueError: the patch has a wrong shape or dtype.
    """
    if patch.ndim != 3 or patch.shape[2] != 3 or patch.dtype != np.uint8 or 0 in patch.shape:
        raise ValueError(f"a patch must be (h, w, 3) uint8, got {patch.shape} {patch.dtype}")
    width, height = size_px
    if width % patch.shape[1] == 0 and height % patch.shape[0] == 0:
        face = patch.repeat(height // patch.shape[0], axis=0).repeat(width // patch.shape[1], axis=1)
    else:
        srgb = srgb_from_linear(resample_linear(LINEAR_FROM_BYTE[patch], size_px))
        face = np.floor(srgb * 255 + 0.5).astype(np.uint8)
    face.setflags(write=False)
    return face


def uniform_face(value: int, size_px: tuple[int, int] = FACE_SIZE_PX) -> UInt8Image:
    """A face's texture of one grey.

    Args:
        value: the sRGB byte of all values, 0..255.
        size_px: width and height of the texture.

    Returns:
        (size_px[1], size_px[0], 3) uint8, read-only.
    """
    face = np.full((size_px[1], size_px[0], 3), value, np.uint8)
    face.setflags(write=False)
    return face
