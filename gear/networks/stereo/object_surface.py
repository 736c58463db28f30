"""Approximates the disparity of visible vehicle surfaces from the vehicles' 3D boxes."""

from __future__ import annotations

import math

import numpy as np

from gear.groundtruth.boxes import Box3d
from gear.values.geometry import Array

SOLID = ("Car", "Van", "Truck")
"""Kinds of objects that fill the lower half of their 3D box."""

FOOT_SHARE = 0.1
"""Share of a 3D box's height, at the bottom, where the road is visible between the wheels."""

MOST_OCCLUDED = 0.3


def depth_of_box(box: Box3d, rays: Array) -> Array:
    """The (…) depth z at which rays from the camera enter a 3D box; NaN for rays that miss the box.

    Args:
        box: 3D box in the camera frame, metres.
        rays: (…, 3) directions with z = 1.
    """
    c, s = math.cos(box.rotation_y_rad), math.sin(box.rotation_y_rad)
    box_from_camera = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    half = np.array([box.length_m, box.height_m, box.width_m]) / 2
    start = box_from_camera @ -(np.array(box.bottom_m) - (0.0, box.height_m / 2, 0.0))
    along = rays @ box_from_camera.T
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (-half - start) / along, (half - start) / along
    enter, leave = np.fmin(one, two).max(axis=-1), np.fmax(one, two).min(axis=-1)
    return np.asarray(np.where((enter < leave) & (enter > 0), enter, np.nan))
