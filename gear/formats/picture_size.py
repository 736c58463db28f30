"""Checks the size of a picture by its header, before it is decoded: a small file may decode to gigabytes."""

from __future__ import annotations

import io

import imagesize

MOST_SIDE_PX = 8192
"""Largest side of a picture that gear reads or writes."""


def check_size(data: bytes, *, least_px: int = 1, most_px: int = MOST_SIDE_PX) -> None:
    """Checks the width and height in the header of an encoded picture, without decoding it.

    Args:
        data: a PNG, JPEG, TIFF, BMP, WebP or PNM file.
        least_px: smallest side that is accepted.
        most_px: largest side that is accepted.

    Raises:
        ValueError: the data have no header of a picture, or a side is out of range.
    """
    try:
        width, height = imagesize.get(io.BytesIO(data), exif_rotation=False)
    except Exception as error:  # the package promises no kind of error for damaged headers
        raise ValueError("not a picture") from error
    if min(width, height) < 0:
        raise ValueError("not a picture")
    if not all(least_px <= side <= most_px for side in (width, height)):
        raise ValueError(f"is {width} x {height} px; sides of {least_px} to {most_px} px are possible")
