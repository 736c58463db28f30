"""The gap to an object from its box in the picture: the foot of the box is on the flat ground.

The method is that of monocular systems with a calibrated camera (Stein, Mano and Shashua, "Vision-based ACC with a
single camera: bounds on range and range rate accuracy", IEEE Intelligent Vehicles Symposium 2003).
"""

from __future__ import annotations

import numpy as np

from gear.plugins.controllers.corridor import Corridor, ground_points
from gear.values.rig import CameraMount

NEAR_GAP_M = 1.0
"""Gap that is assumed for an object whose foot is below the picture."""

POINTS = 5
"""Number of points on the lower side of a box that are looked up on the ground."""


def foot_gap_m(
    box_px: tuple[float, float, float, float], camera: CameraMount, corridor: Corridor, most_m: float
) -> float | None:
    """Free distance from the front of the car to an object in the corridor.

    Args:
        box_px: left, upper, right and lower side of the object's box in the picture; edge pixels, which are index
            pixels plus one half.
        camera: the camera with its pose on the car.
        corridor: the strip of road that the car needs, in the ego frame.
        most_m: arc length on the path beyond which objects do not count.

    Returns:
        The distance in metres; None if the object is not in the corridor, or its foot is above the horizon.
    """
    left_px, _, right_px, bottom_px = box_px
    foot_px = np.array([[column - 0.5, bottom_px - 0.5] for column in np.linspace(left_px, right_px, POINTS)])
    foot_m = ground_points(camera, foot_px)
    if not np.isfinite(foot_m).all():
        return None
    gap_m = corridor.gap_m(foot_m, most_m)
    return min(gap_m, NEAR_GAP_M) if gap_m is not None and bottom_px >= camera.height_px - 1 else gap_m
