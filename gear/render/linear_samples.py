"""Combines the 8-bit samples of a renderer to linear frames, with values in 0..`LINEAR_FULL_SCALE`."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage, IdImage, UInt8Image, UInt16Image

_BAND_ROWS = 64
_STRIP_ROWS = 32

EDGE_DEPTH_STEP = 0.02
"""A pixel lies on an edge if the second difference of inverse depth exceeds this share of its inverse depth."""


def sum_2x2(samples: UInt8Image) -> UInt16Image:
    """Sums each block of 2 x 2 samples: (2H, 2W, 3) uint8 to (H, W, 3) uint16.

    Args:
        samples: the picture with twice the width and height, values 0..255.
    """
    height, width = samples.shape[0] // 2, samples.shape[1] // 2
    sums = np.empty((height, width, 3), np.uint16)
    # In bands: the intermediate array of a whole frame would be as large as the samples.
    for top in range(0, height, _BAND_ROWS):
        pairs = samples[2 * top : 2 * (top + _BAND_ROWS)].reshape(-1, 2, 2 * width * 3)
        columns = np.add(pairs[:, 0], pairs[:, 1], dtype=np.uint16).reshape(-1, width, 2, 3)
        np.add(columns[:, :, 0], columns[:, :, 1], out=sums[top : top + _BAND_ROWS])
    return sums


def four_times(samples: UInt8Image) -> UInt16Image:
    """Multiplies (H, W, 3) uint8 samples by four, to uint16. The full scale then equals that of the sum of four
    samples (`sum_2x2`).

    Args:
        samples: the picture, values 0..255.
    """
    return np.left_shift(samples, 2, dtype=np.uint16)


def smooth_edges(linear_rgb: UInt16Image, geom_id: IdImage, depth_m: FloatImage) -> UInt16Image:
    """The edge filter of quality `fast`: a 3 x 3 Gaussian (sigma 0.8 pixels) on edges, where geom ids change or the
    surface has a crease.

    Other pixels are unchanged.

    Edges are found by ids and depth alone and the filter is linear, so frames stay linear in every albedo. A patch
    cannot influence the filter, unlike a filter that detects contrast.

    Args:
        linear_rgb: (H, W, 3) uint16.
        geom_id: (H, W) int32, -1 where nothing was hit.
        depth_m: (H, W) float32, NaN where nothing was hit.

    Returns:
        (H, W, 3) uint16 smoothed frame, a new array.
    """
    edges = edge_mask(geom_id, depth_m)
    smooth = linear_rgb.copy()
    height = len(edges)
    for top in range(0, height, _STRIP_ROWS):
        bottom = min(top + _STRIP_ROWS, height)
        first = max(top - 1, 0)
        # OpenCV blurs 32-bit floats in a third of the time of 16-bit integers.
        blurred = cv2.GaussianBlur(linear_rgb[first : bottom + 1].astype(np.float32), (3, 3), 0.8)
        blurred += np.float32(0.5)
        blurred = blurred.astype(np.uint16)
        cv2.copyTo(blurred[top - first : bottom - first], edges[top:bottom], smooth[top:bottom])
    return smooth


def edge_mask(geom_id: IdImage, depth_m: FloatImage) -> npt.NDArray[np.uint8]:
    """The pixels on edges: (H, W) uint8, 255 for edges and 0 elsewhere. An edge is a pixel with a neighbour (of four)
    that shows another geom, or a pixel on a silhouette or crease of one geom.

    On a plane 1/z is linear over the picture, so a second difference of 1/z other than zero means that the surface is
    not a plane.

    Args:
        geom_id: (H, W) geom ids; -1 for none.
        depth_m: (H, W) planar depth in metres.
    """
    height, width = geom_id.shape
    edges = np.empty((height, width), np.uint8)
    # Strips of rows, with a row above and below, stay in the processor's cache.
    for top in range(0, height, _STRIP_ROWS):
        bottom = min(top + _STRIP_ROWS, height)
        first, last = max(top - 1, 0), min(bottom + 1, height)
        found = _edges(geom_id[first:last], depth_m[first:last])
        np.multiply(found[top - first : bottom - first].view(np.uint8), np.uint8(255), out=edges[top:bottom])
    return edges


def _edges(geom_id: IdImage, depth_m: FloatImage) -> npt.NDArray[np.bool_]:
    """(h, W) bool edges of a strip. Its first and last row lack the neighbours outside the strip."""
    edges = np.zeros(geom_id.shape, np.bool_)
    across, down = geom_id[:, 1:] != geom_id[:, :-1], geom_id[1:] != geom_id[:-1]
    edges[:, 1:] |= across
    edges[:, :-1] |= across
    edges[1:] |= down
    edges[:-1] |= down
    inverse = 1 / depth_m
    cv2.patchNaNs(inverse, 0.0)
    limit, twice = np.float32(EDGE_DEPTH_STEP) * inverse, inverse + inverse
    for near, far, middle in (
        (np.s_[:, :-2], np.s_[:, 2:], np.s_[:, 1:-1]),
        (np.s_[:-2], np.s_[2:], np.s_[1:-1]),
    ):
        bend = inverse[far] + inverse[near]
        bend -= twice[middle]
        edges[middle] |= np.abs(bend, out=bend) > limit[middle]
    return edges


def ids_from_rgb(pixels: UInt8Image) -> IdImage:
    """Decodes geom ids from a picture in which each geom has a colour of its own.

    Args:
        pixels: (H, W, 3) uint8 with r + 256 g + 65536 b = id + 1.

    Returns:
        (H, W) int32 ids, -1 where the picture is black.
    """
    packed = cv2.cvtColor(pixels, cv2.COLOR_RGB2RGBA)
    packed[..., 3] = 0
    ids: IdImage = packed.view(np.int32)[..., 0] - np.int32(1)
    return ids
