from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from gear.formats.picture_size import check_size
from gear.formats.png import decode_plain, decode_rgb


def bomb(side: int, depth: int = 16, colour: int = 2) -> bytes:
    """A PNG whose header promises a square of so many pixels a side; its rows are missing."""

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    header = struct.pack(">IIBBBBB", side, side, depth, colour, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tiff", ".bmp", ".webp", ".ppm"])
def test_sizes_are_read_from_headers(suffix: str) -> None:
    data = cv2.imencode(suffix, np.zeros((20, 50, 3), np.uint8))[1].tobytes()
    check_size(data)
    for limits in ({"least_px": 21}, {"most_px": 49}):
        with pytest.raises(ValueError, match="is 50 x 20 px; sides of"):
            check_size(data, **limits)


@pytest.mark.parametrize("data", [b"", b"GIF", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0\x00", b"II*\0\xff\xff"])
def test_what_has_no_header_is_no_picture(data: bytes) -> None:
    with pytest.raises(ValueError, match="not a picture"):
        check_size(data)


@pytest.mark.parametrize(("depth", "colour"), [(8, 2), (16, 2), (8, 0), (16, 0)])
def test_a_picture_that_unpacks_to_gigabytes_is_never_unpacked(depth: int, colour: int) -> None:
    for decode in (decode_rgb, decode_plain):
        with pytest.raises(ValueError, match="is 9000 x 9000 px; sides of 1 to 8192 px are possible"):
            decode(bomb(9000, depth, colour))
