"""Small PNGs: few colours in an order that filters can guess, and the smallest of several ways to pack them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image as PillowImage

Image = npt.NDArray[np.uint8]
# Sizes of a palette, and the error (RMS over pixels and channels, of 255) at which the smaller one will do: below
# what the grain of any of the pictures hides.
PALETTES, HARMLESS_ERROR = (64, 128, 256), 1.0
_LUMA = (299, 587, 114)
_STRATEGIES = (zlib.Z_DEFAULT_STRATEGY, zlib.Z_HUFFMAN_ONLY)
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_BITS, _INDEXED = 8, 3


def write_png(path: Path, image: Image) -> None:
    """Write (H, W, 3) as a palette image of no more than 256 colours, a third of the size for noise."""
    indices, colours = few_colours(image)
    height, width = indices.shape
    head = struct.pack(">IIBBBBB", width, height, _BITS, _INDEXED, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"PLTE", colours.tobytes()), (b"IDAT", _packed(indices)), (b"IEND", b""))
    path.write_bytes(_SIGNATURE + b"".join(_chunk(kind, data) for kind, data in chunks))


def few_colours(image: Image) -> tuple[Image, Image]:
    """The picture as indices (H, W) into colours (K, 3), darkest first, so that neighbours have near indices.

    Args:
        image: (H, W, 3).
    """
    for count in PALETTES:
        picture = PillowImage.fromarray(image).quantize(
            count, method=PillowImage.Quantize.MEDIANCUT, dither=PillowImage.Dither.NONE
        )
        colours = np.array(picture.getpalette(), np.uint8).reshape(-1, 3)
        indices = np.asarray(picture)
        error = colours[indices].astype(np.float64) - image
        if float((error**2).mean()) <= HARMLESS_ERROR**2:
            break
    used = np.unique(indices)
    order = used[np.argsort(colours[used].astype(int) @ _LUMA, kind="stable")]
    rank = np.zeros(len(colours), np.uint8)
    rank[order] = np.arange(len(order))
    return rank[indices], colours[order]


def _packed(indices: Image) -> bytes:
    """The smallest of all filters and strategies."""
    best = b""
    for number, rows in enumerate(_filtered(indices)):
        raw = np.insert(rows, 0, number, axis=1).tobytes()
        for strategy in _STRATEGIES:
            packer = zlib.compressobj(9, zlib.DEFLATED, zlib.MAX_WBITS, 9, strategy)
            data = packer.compress(raw) + packer.flush()
            if not best or len(data) < len(best):
                best = data
    return best


def _filtered(pixels: Image) -> list[Image]:
    """Each pixel less what PNG's five filters guess of it: nothing, left, above, their mean, Paeth's choice."""
    around = np.pad(pixels.astype(np.int64), ((1, 0), (1, 0)))
    left, above, corner = around[1:, :-1], around[:-1, 1:], around[:-1, :-1]
    # Paeth: of the three the nearest to left + above - corner.
    far_left, far_above, far_corner = abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)
    paeth = np.where(
        (far_left <= far_above) & (far_left <= far_corner), left, np.where(far_above <= far_corner, above, corner)
    )
    guesses = (np.zeros_like(left), left, above, (left + above) // 2, paeth)
    return [(around[1:, 1:] - guess).astype(np.uint8) for guess in guesses]


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
