"""Linear frames, 0..`LINEAR_FULL_SCALE`, from a renderer's 8-bit samples."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage, IdImage, UInt8Image, UInt16Image

_BAND_ROWS = 64

EDGE_DEPTH_STEP = 0.02
"""A pixel is on an edge where the second difference of inverse depth exceeds this share of its inverse depth."""


def sum_2x2(samples: UInt8Image) -> UInt16Image:
    """(2H, 2W, 3) uint8 samples to (H, W, 3) uint16: the sum of each block of four."""
    height, width = samples.shape[0] // 2, samples.shape[1] // 2
    sums = np.empty((height, width, 3), np.uint16)
    # In bands: the intermediate array of a whole frame would be as large as the samples.
    for top in range(0, height, _BAND_ROWS):
        pairs = samples[2 * top : 2 * (top + _BAND_ROWS)].reshape(-1, 2, 2 * width * 3)
        columns = np.add(pairs[:, 0], pairs[:, 1], dtype=np.uint16).reshape(-1, width, 2, 3)
        np.add(columns[:, :, 0], columns[:, :, 1], out=sums[top : top + _BAND_ROWS])
    return sums


def four_times(samples: UInt8Image) -> UInt16Image:
    """(H, W, 3) uint8 to uint16 with the same full scale as the sum of four samples."""
    return np.left_shift(samples, 2, dtype=np.uint16)


def smooth_edges(linear_rgb: UInt16Image, geom_id: IdImage, depth_m: FloatImage) -> UInt16Image:
    """The edge filter of `fast`: a 3 x 3 tent (1 2 1) where ids change or depth bends, nothing elsewhere.

    Edges come from ids and depth alone and the filter is linear, so frames stay linear in every albedo: unlike a filter
    that detects contrast, it cannot be influenced by a patch.

    Args:
        linear_rgb: (H, W, 3) uint16.
        geom_id: (H, W) int32, -1 where nothing is.
        depth_m: (H, W) float32, NaN where nothing is.

    Returns:
        (H, W, 3) uint16, a new array.
    """
    smooth = cv2.GaussianBlur(linear_rgb, (3, 3), 0.8)
    edges = edge_mask(geom_id, depth_m)
    return np.asarray(cv2.copyTo(smooth, edges, linear_rgb.copy()), dtype=np.uint16)


def edge_mask(geom_id: IdImage, depth_m: FloatImage) -> npt.NDArray[np.uint8]:
    """(H, W) uint8, 255 where the 4-neighbourhood holds another geom, or a silhouette or crease of the same one.

    On every plane 1/z is linear over the picture: a second difference that is not zero is no plane.
    """
    edges = np.zeros(geom_id.shape, np.bool_)
    across, down = geom_id[:, 1:] != geom_id[:, :-1], geom_id[1:] != geom_id[:-1]
    edges[:, 1:] |= across
    edges[:, :-1] |= across
    edges[1:] |= down
    edges[:-1] |= down
    inverse = np.nan_to_num(1 / depth_m, copy=False, nan=0.0)
    limit = EDGE_DEPTH_STEP * inverse
    edges[:, 1:-1] |= np.abs(inverse[:, 2:] + inverse[:, :-2] - 2 * inverse[:, 1:-1]) > limit[:, 1:-1]
    edges[1:-1] |= np.abs(inverse[2:] + inverse[:-2] - 2 * inverse[1:-1]) > limit[1:-1]
    return edges.view(np.uint8) * np.uint8(255)


def ids_from_rgb(pixels: UInt8Image) -> IdImage:
    """Decodes ids from colours.

    Args:
        pixels: (H, W, 3) uint8 that count r + 256 g + 65536 b = id + 1.

    Returns:
        (H, W) int32, -1 where the picture is black.
    """
    packed = cv2.cvtColor(pixels, cv2.COLOR_RGB2RGBA)
    packed[..., 3] = 0
    ids: IdImage = packed.view(np.int32)[..., 0] - np.int32(1)
    return ids
