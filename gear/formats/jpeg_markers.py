"""Checks JPEG files marker by marker, before a decoder reads them: decoders fill what is missing with grey.

The layout of markers and segments is that of ITU-T T.81, annex B.
"""

from __future__ import annotations

import re

START, END = b"\xff\xd8", 0xD9
SCAN = 0xDA
ALONE = frozenset({0x01, *range(0xD0, 0xD8)})
"""Markers without a segment: TEM and the restart markers."""

NEXT_MARKER = re.compile(rb"\xff+[^\x00\xff\xd0-\xd7]", re.DOTALL)
"""The next marker after the coded data of a scan, in which 0xff is followed by 0x00 or by a restart marker."""


def check_markers(data: bytes) -> None:
    """Checks that a JPEG file is complete up to its last marker. Files of other formats are accepted without a check.

    Args:
        data: bytes of the file.

    Raises:
        ValueError: a segment is cut off, a marker is no marker, there is no picture, or the last marker is missing.
    """
    if not data.startswith(START):
        return
    at, has_scan = len(START), False
    while at + 2 <= len(data):
        if data[at] != 0xFF:
            raise ValueError("a JPEG file that is damaged between its segments")
        code = data[at + 1]
        if code == 0xFF:  # fill byte
            at += 1
            continue
        if code == END and has_scan:
            return
        at += 2
        if code in ALONE:
            continue
        if code in (0x00, 0xD8, END):
            raise ValueError("a JPEG file that is damaged between its segments")
        length = int.from_bytes(data[at : at + 2], "big")
        if length < 2 or at + length > len(data):
            raise ValueError("a JPEG file that ends within a segment")
        at += length
        if code == SCAN:
            has_scan = True
            found = NEXT_MARKER.search(data, at)
            at = len(data) if found is None else found.start()
    raise ValueError("a JPEG file without its last marker")
