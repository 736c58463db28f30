"""Checks PNG files chunk by chunk, before a decoder reads them.

libpng writes messages about a damaged file to stderr, where only a command's one-line error should appear. The check of
a 3 MB file takes 2 ms; decoding it with OpenCV takes 5 ms (two cores, noise of 1000 x 1000 pixels).
"""

from __future__ import annotations

import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def check_chunks(data: bytes) -> None:
    """Checks that every chunk of a PNG file is complete and intact. Files of other formats are accepted without a
    check.

    Args:
        data: bytes of the file.

    Raises:
        ValueError: a chunk is cut off, its checksum is wrong, or the last chunk is missing.
    """
    if not data.startswith(SIGNATURE):
        return
    view, at = memoryview(data), len(SIGNATURE)
    while at < len(data):
        if at + 12 > len(data):
            raise ValueError("a PNG file that ends within a chunk")
        length = struct.unpack_from(">I", view, at)[0]
        name, end = bytes(view[at + 4 : at + 8]), at + 12 + length
        if end > len(data):
            raise ValueError("a PNG file that ends within a chunk")
        if zlib.crc32(view[at + 4 : end - 4]) != struct.unpack_from(">I", view, end - 4)[0]:
            raise ValueError("a PNG file with a wrong checksum")
        if name == b"IEND":
            return
        at = end
    raise ValueError("a PNG file without its last chunk")
