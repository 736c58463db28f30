"""Fast decoding of the simple PNG files that gear writes, and fast encoding of noisy maps; OpenCV handles all other
files.

libpng spends most of its time on inflating and deflating, which ISA-L does three times as fast, and on undoing the row
filter, which is done here one whole row at a time.
"""

from __future__ import annotations

import struct
from typing import Any

import fpng
import numpy as np
import numpy.typing as npt
from isal import isal_zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"
PLAIN_CHUNKS = {b"IHDR", b"IDAT", b"IEND", b"fdEC"}
"""PNG chunks that do not change the meaning of pixel values, unlike a palette or a gamma. `fdEC` is fpng's marker."""

CHANNELS = {(8, 0): 1, (16, 0): 1, (8, 2): 3}
"""Number of channels by bit depth and PNG colour type (0 is grey, 2 is RGB)."""

NONE, SUB, UP = 0, 1, 2


def decode_rows(data: bytes) -> npt.NDArray[Any] | None:
    """Decodes a simple PNG file: grey to (H, W) uint8 or uint16, RGB to (H, W, 3) uint8.

    The result is None for damaged files and for files with features that gear's own files do not have. These are
    palettes, alpha, other bit depths, interlacing, chunks that change colours, and filters that use more than one
    neighbour.

    Args:
        data: bytes of the file.
    """
    chunks = _chunks(data)
    header = chunks.get(b"IHDR", b"")
    if len(header) != 13 or b"IEND" not in chunks or not chunks.keys() <= PLAIN_CHUNKS:
        return None
    width, height = (int.from_bytes(header[at : at + 4], "big") for at in (0, 4))
    depth_bits, colour, *methods = header[8:]
    channels = CHANNELS.get((depth_bits, colour))
    if channels is None or any(methods) or not width or not height:
        return None
    pixel_bytes = channels * depth_bits // 8
    size = height * (1 + width * pixel_bytes)
    try:
        inflated = isal_zlib.decompressobj().decompress(chunks.get(b"IDAT", b""), size + 1)
    except (isal_zlib.error, OverflowError):  # type: ignore[misc]  # its stub takes the class for an instance
        return None
    if len(inflated) != size:
        return None
    rows = _unfiltered(np.frombuffer(inflated, np.uint8).reshape(height, -1), pixel_bytes)
    if rows is None:
        return None
    if depth_bits == 16:
        return rows.view(">u2").astype(np.uint16)
    return rows.reshape(height, width, 3) if channels == 3 else rows


def encode_deep(values: npt.NDArray[np.uint16]) -> bytes:
    """Encodes an (H, W) uint16 map whose values seldom repeat as a greyscale PNG of 16 bits. The bytes may depend
    on the processor.

    For a predicted depth map, this function takes a seventh of OpenCV's time, and the file is a quarter larger. If the
    bytes of a row can be divided into pixels of three or four bytes, fpng encodes them as colours, because its filter
    and its compression work on bytes. Files that must be the same on every machine are encoded by `gear.formats.png`.

    Args:
        values: (H, W) uint16, such as a predicted depth map.
    """
    height, width = values.shape
    rows = values.astype(">u2").view(np.uint8).reshape(height, -1)
    for channels in (3, 4):
        if rows.shape[1] % channels == 0:
            colours = fpng.from_ndarray(rows.reshape(height, -1, channels))
            return whole(width, height, 16, 0, _chunks(colours)[b"IDAT"])
    filtered = np.empty((height, rows.shape[1] + 1), np.uint8)
    filtered[:, 0] = UP
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])
    return whole(width, height, 16, 0, isal_zlib.compress(filtered, 1))


def whole(width: int, height: int, depth_bits: int, colour: int, deflated: bytes) -> bytes:
    """A complete PNG file, as bytes, from filtered and deflated rows; `colour` is the colour type of the PNG
    specification.

    Args:
        width, height: size of the picture.
        depth_bits: bits per channel.
        colour: colour type of the PNG specification.
        deflated: zlib stream of the filtered rows.
    """
    header = struct.pack(">IIBBBBB", width, height, depth_bits, colour, 0, 0, 0)
    return SIGNATURE + b"".join(
        struct.pack(">I", len(content)) + name + content + struct.pack(">I", isal_zlib.crc32(name + content))
        for name, content in ((b"IHDR", header), (b"IDAT", deflated), (b"IEND", b""))
    )


def _chunks(data: bytes) -> dict[bytes, bytes]:
    """Content of the chunks by name, with chunks of equal name joined; empty if the file is cut off or a checksum is
    wrong.
    """
    found: dict[bytes, list[bytes]] = {}
    at = len(SIGNATURE)
    if not data.startswith(SIGNATURE):
        return {}
    while at < len(data):
        length, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        content, end = data[at + 8 : at + 8 + length], at + 12 + length
        checksum = int.from_bytes(data[end - 4 : end], "big")
        if end > len(data) or isal_zlib.crc32(content, isal_zlib.crc32(name)) != checksum:
            return {}
        found.setdefault(name, []).append(content)
        at = end
    return {name: parts[0] if len(parts) == 1 else b"".join(parts) for name, parts in found.items()}


def _unfiltered(filtered: npt.NDArray[np.uint8], pixel_bytes: int) -> npt.NDArray[np.uint8] | None:
    """Undoes the filters of (H, 1 + W * bytes) rows, whose first byte is the number of the filter; returns (H, W *
    bytes).
    """
    filters = filtered[:, 0]
    if filters.max() > UP:
        return None
    rows = np.empty((len(filtered), filtered.shape[1] - 1), np.uint8)
    for row, kind in enumerate(filters.tolist()):
        stored, pixels = filtered[row, 1:], rows[row]
        if kind == UP and row:  # above the first row all is 0
            np.add(rows[row - 1], stored, out=pixels)
        elif kind == SUB:
            shape = (-1, pixel_bytes)
            np.add.accumulate(stored.reshape(shape), axis=0, dtype=np.uint8, out=pixels.reshape(shape))
        else:
            pixels[:] = stored
    return rows
