"""A laser scan from four depth views around one point, in the pattern of the Velodyne HDL-64E at 10 Hz.

The scanner has 64 beams from 2.0 degrees above to 24.9 degrees below the horizon. Each beam fires once per 0.1729
degrees of azimuth and measures up to 120 m (HDL-64E S2 manual; Geiger et al., Vision meets Robotics: The KITTI Dataset,
2013). Each beam takes the depth of the pixel that it hits, and its point lies on the ray through the middle of that
pixel. The point is therefore exact; its direction differs from that of the beam by at most half a pixel, 0.04 degrees.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage
from gear.values.geometry import Array, RigidTransform
from gear.values.scene import CameraRecord, Pose

BEAMS = 64
HIGHEST_DEG, LOWEST_DEG = 2.0, -24.9
FIRINGS = 2083
"""Number of firings of each beam in one turn; 64 beams and 10 turns per second give 1.333 million points per second."""

LEAST_M, MOST_M = 0.9, 120.0
"""Smallest and largest range that the scanner reports, in metres."""

VIEWS = 4
WIDTH_PX = 1536
FOCAL_PX = WIDTH_PX / 2
"""Focal length of each of the four views in pixels; with it a view covers 90 degrees."""

_CORNER = math.sqrt(2.0)
"""Factor by which a beam is farther from the horizon's row at the sides of a view than in the view's middle."""

CY_PX = math.ceil(FOCAL_PX * math.tan(math.radians(HIGHEST_DEG)) * _CORNER) + 1
HEIGHT_PX = CY_PX + math.ceil(FOCAL_PX * math.tan(math.radians(-LOWEST_DEG)) * _CORNER) + 2

VELODYNE_FROM_CAMERA = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""(3, 3) rotation from a camera's axes (x right, y down, z forward) to the scanner's axes (x forward, y left, z up)."""


def scan_cameras(reference: CameraRecord) -> tuple[CameraRecord, ...]:
    """The four camera views of a laser scanner at the position of a reference camera: ahead, to the left, behind,
    to the right.

    Args:
        reference: the camera at whose position the scanner stands; its pose gives the direction ahead.
    """
    pose = reference.world_from_camera_transform
    return tuple(
        CameraRecord(
            name=f"scan_{number}",
            width_px=WIDTH_PX,
            height_px=HEIGHT_PX,
            focal_px=FOCAL_PX,
            principal_px=((WIDTH_PX - 1) / 2, float(CY_PX)),
            world_from_camera=Pose.from_transform(
                RigidTransform.from_parts(pose.dst, pose.src, pose.rotation @ _turned(number), pose.translation_m)
            ),
        )
        for number in range(VIEWS)
    )


def scan_points(depths_m: Sequence[FloatImage]) -> npt.NDArray[np.float32]:
    """Computes the points of a laser scan from the depth of its four views.

    Args:
        depths_m: (H, W) float32 planar depth of each view of `scan_cameras`, NaN where no surface was hit.

    Returns:
        (N, 4) float32: x forward, y left, z up in metres, and intensity 0..1. The intensity is the cosine of the angle
        between beam and surface normal, as for matt surfaces of equal brightness. Points are ordered by beam, from the
        highest to the lowest, and within a beam by azimuth, from straight ahead to the left.
    """
    azimuth = np.arange(FIRINGS) * (2 * math.pi / FIRINGS)
    elevation = np.radians(np.linspace(HIGHEST_DEG, LOWEST_DEG, BEAMS))
    view = np.floor(azimuth / (math.pi / 2) + 0.5).astype(np.int64) % VIEWS
    within = azimuth - np.where(azimuth > 7 * math.pi / 4, VIEWS, view) * (math.pi / 2)
    column = np.rint((WIDTH_PX - 1) / 2 - FOCAL_PX * np.tan(within)).astype(np.int64).clip(0, WIDTH_PX - 1)
    row = np.rint(CY_PX - FOCAL_PX * np.tan(elevation)[:, None] / np.cos(within)).astype(np.int64)
    points = np.zeros((BEAMS, FIRINGS, 4))
    for number, depth_m in enumerate(depths_m):
        firings = np.flatnonzero(view == number)
        positions = _positions(depth_m)
        rows, columns = row[:, firings], np.broadcast_to(column[firings], (BEAMS, len(firings)))
        hit = positions[rows, columns]
        points[:, firings, :3] = hit @ (VELODYNE_FROM_CAMERA @ _turned(number)).T
        points[:, firings, 3] = _facing(positions, rows, columns)
    range_m = np.linalg.norm(points[..., :3], axis=-1)
    kept = (range_m >= LEAST_M) & (range_m <= MOST_M)  # false of NaN
    return np.asarray(points[kept], dtype=np.float32)


def _turned(number: int) -> Array:
    """(3, 3) from the axes of a view to those of the first one: a turn to the left by a quarter for each view."""
    cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[number]
    return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])


def _positions(depth_m: FloatImage) -> Array:
    """(H, W, 3) positions of pixels in the axes of their view; NaN where there is nothing."""
    rows, columns = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    x, y = (columns - (WIDTH_PX - 1) / 2) / FOCAL_PX, (rows - CY_PX) / FOCAL_PX
    depth = depth_m.astype(np.float64)
    return np.stack([x * depth, y * depth, depth], axis=-1)


def _facing(positions: Array, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]) -> Array:
    """Cosines between the ray to a pixel and the normal of the surface there, from the neighbouring pixels; 0 where a
    neighbour has no depth.
    """
    below = np.minimum(rows + 1, HEIGHT_PX - 1)
    beside = np.minimum(columns + 1, WIDTH_PX - 1)
    here = positions[rows, columns]
    down = positions[below, columns] - positions[below - 1, columns]
    across = positions[rows, beside] - positions[rows, beside - 1]
    normal = np.cross(across, down)
    length = np.linalg.norm(normal, axis=-1) * np.linalg.norm(here, axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.abs((normal * here).sum(axis=-1)) / length
    return np.asarray(np.nan_to_num(cosine).clip(0.0, 1.0))
