"""The corridor: the strip of road along the known lane that the ego car needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.contracts.controllers import Observation, Points
from gear.values.rig import CameraMount

SIDE_MARGIN_M = 0.3
"""Distance that the corridor is wider than the car on each side, metres."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Corridor:
    """The strip of road along the centre line of the lane that the car needs, in the ego frame (metres ahead,
    metres to the left).

    Attributes:
        path_m: (N, 2) points of the centre line, the first one next to the middle of the car.
        half_width_m: half of the strip's width.
        front_m: distance of the car's front from its middle.
    """

    path_m: Points
    half_width_m: float
    front_m: float

    @staticmethod
    def of(observation: Observation) -> Corridor:
        """Makes the corridor of the ego car in one frame: `SIDE_MARGIN_M` wider than the car on each side.

        Args:
            observation: the frame, for the path and the size of the car.
        """
        return Corridor(
            path_m=observation.path_m,
            half_width_m=observation.car.half_width_m + SIDE_MARGIN_M,
            front_m=observation.car.front_m,
        )

    @property
    def length_m(self) -> float:
        """Length of the known path."""
        return float(np.linalg.norm(np.diff(self.path_m, axis=0), axis=1).sum())

    @property
    def lateral_bounds_m(self) -> tuple[float, float]:
        """Right and left end of the strip in the ego frame (y of the car's axes): no point beside them is in it."""
        longest_m = float(np.linalg.norm(np.diff(self.path_m, axis=0), axis=1).max())
        margin_m, left_m = self.half_width_m + longest_m, self.path_m[:, 1]
        return float(left_m.min()) - margin_m, float(left_m.max()) + margin_m

    def along(self, points_m: Points) -> tuple[Points, Points]:
        """Positions of points relative to the path.

        Args:
            points_m: (M, 2) points in the ego frame.

        Returns:
            (M,) arc length on the path from its first point, negative behind it, and (M,) distance to the left of the
            path; both in metres.
        """
        starts, steps = self.path_m[:-1], np.diff(self.path_m, axis=0)
        lengths_m = np.linalg.norm(steps, axis=1)
        units = steps / lengths_m[:, None]
        nearest = np.linalg.norm(points_m[:, None] - (starts + steps / 2)[None], axis=-1).argmin(axis=1)
        offsets, unit = points_m - starts[nearest], units[nearest]
        before_m = np.concatenate([[0.0], np.cumsum(lengths_m)])[nearest]
        arc_m = before_m + (offsets * unit).sum(axis=1)
        return arc_m, unit[:, 0] * offsets[:, 1] - unit[:, 1] * offsets[:, 0]

    def directions(self, arc_m: Points) -> Points:
        """Returns (M, 2) unit vectors along the path, in the ego frame.

        Args:
            arc_m: (M,) arc lengths from the path's first point, metres; beyond the ends the first or last direction is
                taken.
        """
        steps = np.diff(self.path_m, axis=0)
        lengths_m = np.linalg.norm(steps, axis=1)
        index = np.clip(np.searchsorted(np.cumsum(lengths_m), arc_m, side="right"), 0, len(steps) - 1)
        directions: Points = steps[index] / lengths_m[index][:, None]
        return directions

    def gap_m(self, outline_m: Points, most_m: float = np.inf) -> float | None:
        """Free distance from the front of the car to an object on the path.

        Args:
            outline_m: (M, 2) points around the footprint of the object, in order, in the ego frame.
            most_m: arc length on the path beyond which objects do not count.

        Returns:
            The distance, at least 0; None if the object is not in the corridor, or behind the front of the car.
        """
        arc_m, left_m = self.along(outline_m)
        if left_m.min() > self.half_width_m or left_m.max() < -self.half_width_m:
            return None
        nearest_m = float(arc_m.min())
        if float(arc_m.max()) < self.front_m or nearest_m > most_m:
            return None
        return max(0.0, nearest_m - self.front_m)


def ground_points(camera: CameraMount, pixels: Points) -> Points:
    """The points on the flat ground that a camera shows at some pixels.

    Args:
        camera: the camera with its pose on the car.
        pixels: (M, 2) columns and rows, index pixels.

    Returns:
        (M, 2) points in the ego frame; NaN for pixels at or above the horizon.
    """
    rays = pixel_rays(camera, pixels)
    origin = camera.ego_from_camera.translation_m
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(rays[:, 2] < -1e-6, -origin[2] / rays[:, 2], np.nan)
    points: Points = origin[:2] + rays[:, :2] * scale[:, None]
    return points


def pixel_rays(camera: CameraMount, pixels: Points) -> Points:
    """Returns the (M, 3) rays of pixels in the axes of the ego frame, with length 1 along the camera's optical
    axis.

    Args:
        camera: the camera with its pose on the car.
        pixels: (M, 2) columns and rows, index pixels.
    """
    pinhole = camera.intrinsics
    rays = np.stack(
        [
            (pixels[:, 0] - pinhole.cx_px) / pinhole.fx_px,
            (pixels[:, 1] - pinhole.cy_px) / pinhole.fy_px,
            np.ones(len(pixels)),
        ],
        axis=1,
    )
    turned: Points = rays @ camera.ego_from_camera.rotation.T
    return turned


def ground_pixels(camera: CameraMount, points_m: Points) -> tuple[Points, npt.NDArray[np.bool_]]:
    """The pixels at which a camera shows points of the flat ground.

    Args:
        camera: the camera with its pose on the car.
        points_m: (M, 2) points in the ego frame.

    Returns:
        (M, 2) columns and rows in index pixels, and (M,) bool: whether the point is in the picture.
    """
    pinhole, pose = camera.intrinsics, camera.ego_from_camera
    on_ground = np.column_stack([points_m, np.zeros(len(points_m))])
    seen = (on_ground - pose.translation_m) @ pose.rotation
    depth_m = np.maximum(seen[:, 2], 1e-6)
    pixels: Points = np.stack(
        [
            pinhole.cx_px + pinhole.fx_px * seen[:, 0] / depth_m,
            pinhole.cy_px + pinhole.fy_px * seen[:, 1] / depth_m,
        ],
        axis=1,
    )
    inside = (seen[:, 2] > 0.1) & (pixels > -0.5).all(axis=1)
    inside &= (pixels[:, 0] < pinhole.width_px - 0.5) & (pixels[:, 1] < pinhole.height_px - 0.5)
    return pixels, inside
