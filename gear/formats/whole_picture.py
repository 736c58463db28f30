"""Checks that an encoded picture is complete, before a decoder fills in what is missing."""

from __future__ import annotations

from gear.formats.jpeg_markers import check_markers
from gear.formats.png_chunks import check_chunks


def check_whole(data: bytes) -> None:
    """Checks a PNG file chunk by chunk and a JPEG file marker by marker; other formats are accepted without a check.

    Args:
        data: bytes of the file.

    Raises:
        ValueError: a part of the file is missing or damaged.
    """
    check_chunks(data)
    check_markers(data)
