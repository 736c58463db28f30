"""Dense photometric alignment (Stereo R-CNN, section 4.2): finds the depth of a car at which its pixels match best
between the left and the right picture.

Each pixel in the lower half of the car's 2D box gets the depth of the 3D box's surface, relative to the depth of the
box's centre. The centre is then moved along the depth axis until the sum of absolute differences between the pictures
is smallest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.kitti_object import Calibration
from gear.groundtruth.boxes import Box3d
from gear.networks.stereo.box_solver import Measured
from gear.networks.stereo.object_surface import FOOT_SHARE, depth_of_box
from gear.values.geometry import Array

UPSAMPLED = 2
MOST_SAMPLES = 56
"""Largest number of rows, and of columns, of a car's box that are compared; larger boxes are sampled."""

COARSE_STEPS, COARSE_M = 50, 0.5
FINE_STEPS, FINE_M = 20, 0.05
NEAREST_M = 1.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pair:
    """The left and the right picture, at the size at which they are compared.

    Attributes:
        left, right: (1, 3, h, w) float.
        scale: factor from the size of the original pictures to h and w.
    """

    left: Tensor
    right: Tensor
    scale: float

    @staticmethod
    def of(left: Tensor, right: Tensor, scale: float) -> Pair:
        """Makes a pair from two pictures, which are enlarged by a factor of two for the comparison.

        Args:
            left, right: (1, 3, H, W) pictures.
            scale: factor from the size of the original pictures to H and W.
        """
        up = [
            functional.interpolate(picture, scale_factor=UPSAMPLED, mode="bilinear", align_corners=False)
            for picture in (left, right)
        ]
        return Pair(left=up[0], right=up[1], scale=scale * UPSAMPLED)


def align(pair: Pair, box: Box3d, measured: Measured, calibration: Calibration) -> float | None:
    """Estimates the depth of the centre of a car's 3D box in metres; None if no pixel in the lower half of its 2D
    box shows the 3D box.

    Args:
        pair: the pictures.
        box: estimated 3D box of the car, in the frame of the left camera.
        measured: its 2D box and visible columns in the left picture.
        calibration: calibration of the original pictures.
    """
    pixels, behind_m = _surface(pair, box, measured, calibration)
    if not len(pixels):
        return None
    around_m = box.bottom_m[2]
    for steps, step_m in ((COARSE_STEPS, COARSE_M), (FINE_STEPS, FINE_M)):
        depths_m = np.maximum(around_m + step_m * (np.arange(steps + 1) - steps / 2), NEAREST_M)
        errors = _differences(pair, pixels, behind_m, depths_m, calibration)
        around_m = float(depths_m[int(errors.argmin())])
    return around_m


def _surface(pair: Pair, box: Box3d, measured: Measured, calibration: Calibration) -> tuple[Array, Array]:
    """Pixels of the car and their depths relative to the centre of its box.

    Returns:
        (P, 2) index pixels of the compared pictures, and (P,) distances in metres along the depth axis from the centre
        to the surface.
    """
    top, bottom = measured.left_px[1] * pair.scale, measured.left_px[3] * pair.scale
    left, right = (side * pair.scale for side in measured.borders_px)
    height, width = pair.left.shape[-2:]
    columns = np.arange(max(0, round(left)), min(width, round(right)), max(1, int((right - left) / MOST_SAMPLES)))
    rows = np.arange(
        max(0, round((top + bottom) / 2)),
        min(height, round(bottom - FOOT_SHARE * (bottom - top))),
        max(1, int((bottom - top) / MOST_SAMPLES)),
    )
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2).astype(np.float64)
    original = (pixels + 0.5) / pair.scale - 0.5
    depth_m = depth_of_box(box, calibration.intrinsics.unproject(original, np.ones(len(original))))
    is_hit = np.isfinite(depth_m)
    return pixels[is_hit], depth_m[is_hit] - box.bottom_m[2]


def _differences(pair: Pair, pixels: Array, behind_m: Array, depths_m: Array, calibration: Calibration) -> Array:
    """(D,) mean absolute difference between the pictures for each of D depths of the box's centre."""
    reach_px = calibration.intrinsics.focal_px * calibration.baseline_m * pair.scale
    disparities = reach_px / np.maximum(depths_m[:, None] + behind_m[None], NEAREST_M / 2)
    shifted = np.stack([pixels[None, :, 0] - disparities, np.broadcast_to(pixels[:, 1], disparities.shape)], axis=-1)
    here = _sampled(pair.left, pixels[None])
    there = _sampled(pair.right, shifted)
    return np.asarray((here - there).abs().mean(dim=(0, 2)).double().cpu().numpy())


def _sampled(picture: Tensor, pixels: Array) -> Tensor:
    """(3, D, P) colours at (D, P, 2) index pixels, by bilinear interpolation; outside, the border's colour."""
    height, width = picture.shape[-2:]
    grid = 2 * pixels / (width - 1, height - 1) - 1
    places = torch.from_numpy(grid).to(picture)[None]
    return functional.grid_sample(picture, places, mode="bilinear", padding_mode="border", align_corners=True)[0]
