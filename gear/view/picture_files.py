"""Finds the file of a dataset that holds the picture of a camera, for any task."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import cv2
import numpy as np

from gear.contracts.tasks import Sidecar
from gear.dataset.files import inside, read_bytes
from gear.formats.picture_size import check_size
from gear.formats.quiet_decoder import decode_quietly
from gear.formats.whole_picture import check_whole
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image

PICTURE_FILES = (".png", ".jpg", ".jpeg", ".webp")
"""Suffixes of files that may hold a picture of a camera."""


def picture_file(root: Path, sidecar: Sidecar, pixels: UInt8Image) -> str | None:
    """Returns the path, relative to the dataset's root, of a sample's picture file with exactly these pixels.

    Files are compared by their pixels because only the task knows the names of its files.

    Args:
        root: root of the dataset.
        sidecar: metadata of the sample, which lists its files.
        pixels: (H, W, 3) uint8 RGB.

    Returns:
        The path; None if no file inside the dataset has these pixels.
    """
    for relative in sidecar.files:
        if is_inside(relative) and PurePosixPath(relative).suffix.lower() in PICTURE_FILES:
            try:
                data = read_bytes(inside(root, relative))
            except DatasetError:
                continue
            try:
                check_size(data)
                check_whole(data)
            except ValueError:
                continue
            stored = decode_quietly(data, cv2.IMREAD_COLOR)
            if stored is not None and np.array_equal(stored[..., ::-1], pixels):
                return relative
    return None


def is_inside(relative: str) -> bool:
    """Returns whether a relative path from a sample's metadata stays inside the dataset; other paths are not followed.

    Args:
        relative: the path, with `/` between folders.
    """
    pure = PurePosixPath(relative)
    return not pure.is_absolute() and ".." not in pure.parts and "\\" not in relative and "\0" not in relative
