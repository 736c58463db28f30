"""Laser scans as files of a sample, in KITTI's format: little-endian float32 x, y, z and intensity of each point."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Auxiliary
from gear.dataset.layout import SCANS, auxiliary_path
from gear.dataset.probe_files import AuxiliaryFiles
from gear.formats.kitti_object import SCAN, format_points

KIND = SCANS


def scan_files(points: npt.NDArray[np.float32], split: str, index: int) -> AuxiliaryFiles:
    """Encodes one laser scan as a file, by its name in the sidecar (the JSON file of the sample).

    Args:
        points: (N, 4) float32: x forward, y left, z up in metres, and intensity in 0..1.
        split: name of the split.
        index: index of the sample.
    """
    path = auxiliary_path(split, KIND, index, "velodyne.bin")
    return {SCAN: (Auxiliary(path=path, facts={"points": len(points)}), format_points(points))}
