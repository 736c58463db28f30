"""KITTI depth files: 16-bit pictures in units of 1/256 m, float files in metres, and the file lists of loaders."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array

UNITS_PER_M = 256
MAX_PNG_DEPTH_M = 65535 / UNITS_PER_M
"""Largest depth in metres that 16 bits in units of 1/256 m can hold. Larger ground-truth depths are written as 0."""


def to_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """Converts (H, W) ground-truth depth in metres to KITTI's units of 1/256 m.

    NaN (no ground truth, such as sky) and depths beyond the range of 16 bits become 0.

    Args:
        depth_m: (H, W) depth in metres.
    """
    units = depth_m * np.float32(UNITS_PER_M)
    np.rint(units, out=units)
    np.copyto(units, 0, where=~((units >= 1) & (units <= 65535)))  # what is not finite is neither
    return units.astype(np.uint16)


def to_predicted_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """Converts (H, W) predicted depth in metres to KITTI's units of 1/256 m, clipped to 1..65535; only NaN becomes
    0.

    KITTI's development kit treats 0 as a missing prediction and interpolates such pixels before it computes metrics.

    Args:
        depth_m: (H, W) depth in metres.
    """
    return to_units(np.clip(depth_m, np.float32(1 / UNITS_PER_M), np.float32(MAX_PNG_DEPTH_M)))


def from_units(units: npt.NDArray[np.uint16]) -> FloatImage:
    """Converts (H, W) depth in KITTI's units of 1/256 m to metres; 0 becomes NaN (no ground truth).

    Args:
        units: (H, W) values of the 16-bit picture.

    Returns:
        (H, W) float32.
    """
    return np.where(units > 0, units / np.float32(UNITS_PER_M), np.nan).astype(np.float32)


def to_metres_file(depth_m: FloatImage) -> FloatImage:
    """Converts (H, W) depth in metres to the form that CARLA-GeAR's loader reads: NaN (no depth) becomes 0.

    Args:
        depth_m: (H, W) depth in metres.
    """
    return np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)


def from_metres_file(stored: FloatImage) -> FloatImage:
    """Converts (H, W) depth in metres from a file of CARLA-GeAR's form: 0 (no depth) becomes NaN.

    Args:
        stored: (H, W) content of the file.
    """
    depth_m = stored.astype(np.float32)
    np.copyto(depth_m, np.nan, where=~(stored > 0))
    return depth_m


def file_list(pairs: Sequence[tuple[str, str]]) -> bytes:
    """The bytes of a file list with one line `/picture /depth` per sample and without a final newline.

    The paths begin with `/`, because loaders append them to the root folder as strings.

    Args:
        pairs: path of the picture and path of the depth of each sample, relative to the dataset's root, without leading
            `/`.
    """
    return "\n".join(f"/{image} /{depth}" for image, depth in pairs).encode()


def intrinsics_text(matrix: Array) -> bytes:
    """The nine numbers of a (3, 3) camera matrix K as text, row by row, as in KITTI's `val_selection_cropped`.

    Args:
        matrix: (3, 3) camera matrix in pixels.
    """
    return (" ".join(f"{v:.6f}" for v in matrix.reshape(-1)) + "\n").encode()
