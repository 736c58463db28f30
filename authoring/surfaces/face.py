"""The neutral face of a billboard: blank light-grey vinyl sheet, as it hangs between two campaigns."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.rng import derive_rng

FACE_SIZE_PX = (1024, 512)
_VINYL_SRGB = 205.0
_SHEETS = 4


def neutral_face() -> npt.NDArray[np.uint8]:
    """Draw the blank vinyl: welded sheets, weave and faint streaks of weather.

    Returns:
        (512, 1024, 3) uint8 sRGB, row 0 at the top of the board.
    """
    width, height = FACE_SIZE_PX
    rng = derive_rng(0, "billboard", "face")
    blotches = cv2.GaussianBlur(rng.normal(size=(height, width)), (0, 0), 40.0)
    streaks = cv2.GaussianBlur(rng.normal(size=(1, width)), (0, 0), 3.0).repeat(height, axis=0)
    weave = rng.normal(size=(height, width))
    grey = _VINYL_SRGB + 60.0 * blotches + 2.5 * streaks + 0.7 * weave
    for sheet in range(1, _SHEETS):
        seam = sheet * width // _SHEETS
        grey[:, seam - 1 : seam + 1] -= 9.0
        grey[:, seam + 1 : seam + 5] += 2.0
    levels = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.repeat(levels[:, :, None], 3, axis=2)


def write_neutral_face(path: Path) -> None:
    """Write the blank vinyl as a PNG."""
    if not cv2.imwrite(str(path), neutral_face(), [cv2.IMWRITE_PNG_COMPRESSION, 9]):
        raise OSError(f"cannot write {path}")
