"""KITTI depth: 16-bit pictures of 1/256 m, exact depth in metres beside them, and the lists that loaders read."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array

UNITS_PER_M = 256
MAX_PNG_DEPTH_M = 65535 / UNITS_PER_M
"""Depth beyond it cannot be said in 16 bits and is left out."""


def to_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """(H, W) metres, NaN for nothing, to 1/256 m; 0 stands for no ground truth (sky, beyond range)."""
    units = depth_m * np.float32(UNITS_PER_M)
    np.rint(units, out=units)
    np.copyto(units, 0, where=~((units >= 1) & (units <= 65535)))  # what is not finite is neither
    return units.astype(np.uint16)


def to_predicted_units(depth_m: FloatImage) -> npt.NDArray[np.uint16]:
    """(H, W) predicted metres to 1/256 m, the nearest that 16 bits can say; 0 only for NaN.

    In a prediction 0 stands for none, and the devkit fills such pixels from their neighbours before it measures.
    """
    return to_units(np.clip(depth_m, np.float32(1 / UNITS_PER_M), np.float32(MAX_PNG_DEPTH_M)))


def from_units(units: npt.NDArray[np.uint16]) -> FloatImage:
    """(H, W) 1/256 m to metres, NaN for 0."""
    return np.where(units > 0, units / np.float32(UNITS_PER_M), np.nan).astype(np.float32)


def to_metres_file(depth_m: FloatImage) -> FloatImage:
    """(H, W) metres as the original's public loader wants them: 0 for nothing."""
    return np.nan_to_num(depth_m, nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)


def from_metres_file(stored: FloatImage) -> FloatImage:
    """(H, W) metres with NaN for nothing."""
    depth_m = stored.astype(np.float32)
    np.copyto(depth_m, np.nan, where=~(stored > 0))
    return depth_m


def file_list(pairs: Sequence[tuple[str, str]]) -> bytes:
    """`/picture /depth` a line, without a last newline: loaders append the paths to the root as strings."""
    return "\n".join(f"/{image} /{depth}" for image, depth in pairs).encode()


def intrinsics_text(matrix: Array) -> bytes:
    """The nine numbers of a (3, 3) K, row by row, as the benchmark's selection has them."""
    return (" ".join(f"{v:.6f}" for v in matrix.reshape(-1)) + "\n").encode()
