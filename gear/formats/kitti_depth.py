"""KITTI depth: 16-bit pictures in units of 1/256 m, exact depth files in metres, and the file lists of loaders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array

UNITS_PER_M = 256
MAX_PNG_DEPTH_M = 65535 / UNITS_PER_M
"""Largest depth that 16 bits of 1/256 m can hold; larger ground truth is written as 0."""


def to_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """Converts (H, W) metres, NaN without ground truth (sky, beyond range), to 1/256 m with 0 for NaN."""
    units = depth_m * np.float32(UNITS_PER_M)
    np.rint(units, out=units)
    np.copyto(units, 0, where=~((units >= 1) & (units <= 65535)))  # what is not finite is neither
    return units.astype(np.uint16)


def to_predicted_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """Converts (H, W) predicted metres to 1/256 m, clipped to 1..65535; only NaN becomes 0.

    The devkit takes 0 for a missing prediction and interpolates such pixels before it computes metrics.
    """
    return to_units(np.clip(depth_m, np.float32(1 / UNITS_PER_M), np.float32(MAX_PNG_DEPTH_M)))


def from_units(units: npt.NDArray[np.uint16]) -> FloatImage:
    """Converts (H, W) 1/256 m to metres, with NaN for 0."""
    return np.where(units > 0, units / np.float32(UNITS_PER_M), np.nan).astype(np.float32)


def to_metres_file(depth_m: FloatImage) -> FloatImage:
    """Converts (H, W) metres to the form of CARLA-GeAR's loader: 0 instead of NaN."""
    return np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)


def from_metres_file(stored: FloatImage) -> FloatImage:
    """Converts (H, W) metres of such a file back: NaN instead of 0."""
    depth_m = stored.astype(np.float32)
    np.copyto(depth_m, np.nan, where=~(stored > 0))
    return depth_m


def file_list(pairs: Sequence[tuple[str, str]]) -> bytes:
    """A file list with one line `/picture /depth` per sample and no final newline; loaders append the paths to the root
    as strings.
    """
    return "\n".join(f"/{image} /{depth}" for image, depth in pairs).encode()


def intrinsics_text(matrix: Array) -> bytes:
    """The nine numbers of a (3, 3) camera matrix K, row by row, as in the benchmark's cropped selection."""
    return (" ".join(f"{v:.6f}" for v in matrix.reshape(-1)) + "\n").encode()
