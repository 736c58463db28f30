"""COCO's compressed run-length encoding (RLE) of masks, as strings that pycocotools reads.

Pixels are ordered by columns, and the first run consists of zeros. Masks are encoded from crops, so the time depends on
the size of the object and not on the size of the picture.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pycocotools import mask as coco_mask

from gear.values.run_lengths import run_lengths

Mask = npt.NDArray[np.bool_]


def encode_crop(mask: Mask, left: int, top: int, height_px: int, width_px: int) -> str:
    """Encodes a mask of a whole picture as an RLE string. The picture is empty except for the crop `mask`, whose first
    pixel is at (left, top).

    Args:
        mask: (h, w) bool mask.
        left, top: column and row of the first pixel of `mask` in the picture.
        height_px, width_px: size of the picture.
    """
    rows, columns = mask.shape
    if left < 0 or top < 0 or left + columns > width_px or top + rows > height_px:
        raise ValueError(f"mask of shape {mask.shape} at ({left}, {top}) leaves the picture ({height_px}, {width_px})")
    slab = np.zeros((columns, height_px), dtype=np.bool_)
    slab[:, top : top + rows] = mask.T
    padded = np.concatenate([[False], slab.reshape(-1), [False]])
    switches = np.flatnonzero(padded[1:] != padded[:-1]) + left * height_px
    counts = np.diff(np.concatenate([[0], switches, [height_px * width_px]]))
    if len(counts) > 1 and counts[-1] == 0:
        counts = counts[:-1]
    encoded = coco_mask.frPyObjects({"size": [height_px, width_px], "counts": counts.tolist()}, height_px, width_px)
    return str(encoded["counts"].decode("ascii"))


def encode(mask: Mask) -> str:
    """Encodes an (H, W) bool mask as an RLE string.

    Args:
        mask: (H, W) bool.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not rows.size:
        return encode_crop(np.zeros((0, 0), np.bool_), 0, 0, *mask.shape)
    top, left = int(rows[0]), int(columns[0])
    return encode_crop(mask[top : int(rows[-1]) + 1, left : int(columns[-1]) + 1], left, top, *mask.shape)


def check(counts: str, height_px: int, width_px: int) -> None:
    """Checks that a string is a valid RLE of a mask of this size. This takes a fraction of the time of decoding.

    Args:
        counts: the string.
        height_px, width_px: size of the picture.

    Raises:
        ValueError: the string is no RLE, or its runs do not fill a picture of this size.
    """
    _runs(counts, height_px, width_px)


def decode(counts: str, height_px: int, width_px: int) -> Mask:
    """Decodes an RLE string to an (H, W) bool mask.

    Args:
        counts: the string.
        height_px, width_px: size of the picture.

    Raises:
        ValueError: the string is no RLE, or its runs do not fill a picture of this size.
    """
    runs = _runs(counts, height_px, width_px)
    values = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return np.ascontiguousarray(values.reshape(width_px, height_px).T)


def decode_crop(counts: str, height_px: int, width_px: int, box_px: tuple[int, int, int, int]) -> Mask:
    """Decodes the part of an RLE mask inside a box (left, top, right, bottom), which must lie inside the picture.

    Args:
        counts: the string.
        height_px, width_px: size of the picture.
        box_px: left, top, right and bottom in edge pixels, right and bottom excluded.

    Raises:
        ValueError: the string is no RLE, or its runs do not fill a picture of this size.
    """
    left, top, right, bottom = box_px
    runs = _runs(counts, height_px, width_px)
    values = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return np.ascontiguousarray(values.reshape(width_px, height_px)[left:right, top:bottom].T)


def _runs(counts: str, height_px: int, width_px: int) -> npt.NDArray[np.int64]:
    runs = run_lengths(counts)
    if runs.sum() != height_px * width_px:
        raise ValueError(f"run lengths fill {runs.sum()} pixels, not {height_px} x {width_px}")
    return runs
