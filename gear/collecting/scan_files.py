"""Laser scans, as files beside a sample: little-endian float32 x, y, z, intensity of each point, as KITTI has them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Auxiliary
from gear.dataset.layout import auxiliary_path
from gear.dataset.probe_files import AuxiliaryFiles
from gear.formats.kitti_object import SCAN, format_points

KIND = "scans"


def scan_files(points: npt.NDArray[np.float32], split: str, index: int) -> AuxiliaryFiles:
    """The file of one scan, by its name in the sidecar.

    Args:
        points: (N, 4) float32, as of `gear.groundtruth.laser_scan.scan_points`.
        split: name of the split.
        index: of the sample.
    """
    path = auxiliary_path(split, KIND, index, "velodyne.bin")
    return {SCAN: (Auxiliary(path=path, facts={"points": len(points)}), format_points(points))}
