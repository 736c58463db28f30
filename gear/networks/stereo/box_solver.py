"""Computes the 3D box of a car from its 2D boxes in both pictures and one ground corner (Stereo R-CNN, section 4).

Seven measurements determine position and heading of a box of known size: the four sides of the left 2D box, the left
and right side of the right 2D box, and the column of the ground corner that is visible between the sides. Which corner
of the 3D box lies on which side depends on the view. The authors choose among eight cases from a table. This module
projects the corners, solves the equations, and projects the corners again, until the assignment no longer changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from gear.formats.kitti_object import Calibration
from gear.groundtruth.boxes import Box3d
from gear.values.geometry import Array, wrap_angle_rad
from gear.values.ground_truth import BoxPx

BORDER_PX = (20.0, 10.0)
"""Distance from the picture's edge, in x and in y, below which a side of a 2D box may be cut by the picture."""

LEAST_BOX_PX, LEAST_SEEN_PX = 10.0, 3.0
CORNER_WEIGHT = 2.0
MOST_DEPTH_M = 100.0
NEAREST_M = 0.5
ROUNDS = 5

SIGNS = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]) / 2
"""Positions of the four ground corners, as shares of the car's width (to the right) and of its length (to the
front), in the order of `Measured.corner`.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """The measurements of one car that a stereo network predicts, in index pixels of the pictures.

    Attributes:
        left_px: box in the left picture: left, top, right, bottom.
        right_sides_px: left and right side of the box in the right picture.
        corner: which ground corner is visible between the sides, 0..3: rear left, front left, front right, rear right,
            as seen by the driver.
        corner_px: column of that corner.
        borders_px: first and last column in which the car is not occluded.
        width_m, height_m, length_m: size of the car.
        alpha_rad: observation angle.
    """

    left_px: BoxPx
    right_sides_px: tuple[float, float]
    corner: int
    corner_px: float
    borders_px: tuple[float, float]
    width_m: float
    height_m: float
    length_m: float
    alpha_rad: float

    @property
    def alpha_of_corner_rad(self) -> float:
        """Rough observation angle in radians, from the position of the visible ground corner between the sides of
        the 2D box.
        """
        share = (self.corner_px - self.left_px[0]) / max(self.left_px[2] - self.left_px[0], 1e-6)
        turned = math.asin(min(max(share, -1.0), 1.0))
        return wrap_angle_rad((-math.pi / 2, math.pi, math.pi / 2, 0.0)[self.corner] - turned)


def solve_box(measured: Measured, calibration: Calibration, depth_m: float | None = None) -> Box3d | None:
    """Finds the 3D box that fits the measurements of one car best, in the least-squares sense.

    Args:
        measured: measurements of one car.
        calibration: calibration of the stereo pair.
        depth_m: depth of the box's centre if it is known from alignment; the right picture is then not used.

    Returns:
        The box; None if the 2D boxes are too small, the car is hardly visible, or no plausible box fits.
    """
    left, top, right, bottom = measured.left_px
    seen_px = measured.borders_px[1] - measured.borders_px[0]
    if seen_px < LEAST_SEEN_PX or min(right - left, bottom - top) < LEAST_BOX_PX:
        return None
    problem = _Problem.of(measured, calibration, depth_m)
    starts = [problem.start(angle) for angle in (measured.alpha_of_corner_rad, measured.alpha_rad)]
    solved = [_descend(problem, start) for start in starts if start is not None]
    if not solved:
        return None
    _, state = min(solved, key=lambda found: found[0])
    x, y, z, rotation_y = problem.whole(state)
    if not (NEAREST_M < z < MOST_DEPTH_M and all(math.isfinite(value) for value in (x, y, rotation_y))):
        return None
    return Box3d(
        height_m=measured.height_m,
        width_m=measured.width_m,
        length_m=measured.length_m,
        bottom_m=(x, y, z),
        rotation_y_rad=wrap_angle_rad(rotation_y),
    )


def _descend(problem: _Problem, state: Array) -> tuple[float, Array]:
    """Remaining error and unknowns after Gauss-Newton descent."""
    cost, corners = math.inf, tuple[int, ...]()
    for _ in range(ROUNDS):
        chosen = problem.silhouette(state)
        if chosen == corners:
            break
        corners = chosen
        found = least_squares(problem.errors, state, args=(corners,), method="trf", x_scale=problem.scale())
        cost, state = float(found.cost), found.x
    return cost, state


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Problem:
    """Least-squares problem with the unknowns x, y, z (if not known) and rotation_y; residuals are in units of
    the focal length.
    """

    measured: Measured
    baseline_m: float
    depth_m: float | None
    sides: Array
    rows: Array
    right_sides: Array
    corner: float
    alpha_rad: float
    weights: Array

    @staticmethod
    def of(measured: Measured, calibration: Calibration, depth_m: float | None) -> _Problem:
        lens = calibration.intrinsics
        left, top, right, bottom = measured.left_px
        x_edge, y_edge = BORDER_PX
        in_x = np.array([left >= x_edge, right <= lens.width_px - 1 - x_edge])
        in_y = np.array([top >= y_edge, bottom <= lens.height_px - 1 - y_edge])
        right_in_x = np.array(
            [measured.right_sides_px[0] >= x_edge, measured.right_sides_px[1] <= lens.width_px - 1 - x_edge]
        )
        is_whole = bool(in_x.all())
        weights = [*in_x, *in_y, *(right_in_x & (depth_m is None)), CORNER_WEIGHT * is_whole, float(not is_whole)]
        focal = lens.focal_px
        return _Problem(
            measured=measured,
            baseline_m=calibration.baseline_m,
            depth_m=depth_m,
            sides=(np.array([left, right]) - lens.cx_px) / focal,
            rows=(np.array([top, bottom]) - lens.cy_px) / lens.fy_px,
            right_sides=(np.array(measured.right_sides_px) - lens.cx_px) / focal,
            corner=(measured.corner_px - lens.cx_px) / focal,
            # For a car that the picture cuts, the share is not reliable.
            alpha_rad=measured.alpha_of_corner_rad if is_whole else measured.alpha_rad,
            weights=np.array(weights, dtype=np.float64),
        )

    def start(self, alpha_rad: float) -> Array | None:
        """First guess of the unknowns, from the disparity of the 2D boxes' centres and an observation angle."""
        z = self.depth_m
        if z is None:
            disparity = float(self.sides.mean() - self.right_sides.mean())
            if disparity <= 0:
                return None
            z = min(self.baseline_m / disparity, MOST_DEPTH_M)
        x = z * float(self.sides.mean())
        y = z * float(self.rows.mean()) + self.measured.height_m / 2
        rotation_y = alpha_rad + math.atan2(x, z)
        return np.array([x, y, rotation_y] if self.depth_m is not None else [x, y, z, rotation_y])

    def whole(self, state: Array) -> tuple[float, float, float, float]:
        """x, y, z and rotation_y of a state; a known z is filled in."""
        x, y, *others = (float(value) for value in state)
        return (x, y, self.depth_m if self.depth_m is not None else others[0], others[-1])

    def scale(self) -> Array:
        """Step of each unknown that changes the picture by about the same amount."""
        return np.array([1.0, 1.0, 0.3] if self.depth_m is not None else [1.0, 1.0, 10.0, 0.3])

    def corners(self, state: Array) -> tuple[Array, float]:
        """(4, 2) x and z of the corners on the ground, and y of the ground."""
        x, y, z, rotation_y = self.whole(state)
        c, s = math.cos(rotation_y), math.sin(rotation_y)
        across, along = self.measured.width_m * SIGNS[:, :1], self.measured.length_m * SIGNS[:, 1:]
        places = np.array([x, z]) + across * (-s, -c) + along * (c, -s)
        # A step of the solver may move the box through the camera; projections must stay finite.
        places[:, 1] = np.maximum(places[:, 1], NEAREST_M)
        return places, y

    def silhouette(self, state: Array) -> tuple[int, ...]:
        """Indices of the corners that lie on the left, right, top and bottom side, and on both sides in the
        right picture.
        """
        places, y = self.corners(state)
        left = places[:, 0] / places[:, 1]
        right = (places[:, 0] - self.baseline_m) / places[:, 1]
        roof, ground = (y - self.measured.height_m) / places[:, 1], y / places[:, 1]
        found = (left.argmin(), left.argmax(), roof.argmin(), ground.argmax(), right.argmin(), right.argmax())
        return tuple(int(corner) for corner in found)

    def errors(self, state: Array, corners: tuple[int, ...]) -> Array:
        """(8,) weighted residuals: left, right, top, bottom, left and right in the right picture, corner, angle."""
        places, y = self.corners(state)
        x, _, z, rotation_y = self.whole(state)
        column, right_column = places[:, 0] / places[:, 1], (places[:, 0] - self.baseline_m) / places[:, 1]
        top = (y - self.measured.height_m) / places[corners[2], 1]
        said = np.array(
            [
                column[corners[0]] - self.sides[0],
                column[corners[1]] - self.sides[1],
                top - self.rows[0],
                y / places[corners[3], 1] - self.rows[1],
                right_column[corners[4]] - self.right_sides[0],
                right_column[corners[5]] - self.right_sides[1],
                column[self.measured.corner] - self.corner,
                wrap_angle_rad(rotation_y - math.atan2(x, z) - self.alpha_rad),
            ]
        )
        return np.asarray(said * self.weights)
