"""Lit windows, and the glare around lamps that shine towards the camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.lamps import Lamps
from gear.camera.light_sources import world_positions
from gear.values.frames import FloatImage, IdImage
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

Lights = npt.NDArray[np.float32]

_NEAREST_M = 0.3
_FRACTION_BITS = 4
_LEAST_SIDE_PX = 0.7
_OFF_PLANE_M = 0.4

_LAMP_RADIUS_M = 0.16
_LEAST_SIGMA_PX = 0.75
_GLARE_SHARE, _GLARE_WIDTH = 0.02, 7.0
_STREAK_WIDTH, _STREAK_LENGTH = 1.6, 0.05
_SPOT_REACH = 4.5
_NEAREST_LAMP_M = 1.0
_HIDDEN_M = 0.8
_MOST = 4.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LitWindows:
    """The N lit windows of a town.

    Attributes:
        corners_m: (N, 4, 3) corners in world coordinates, in order around each window.
        normal: (N, 3) unit vectors that point out of the house.
        geom_id: (N,) id of the geom to which each window belongs.
        gain: (N, 3) factors on the frame's light: curtains or goods that lamps inside make visible.
        light: (N, 3) light that is added to the frame, as a share of full scale.
        reach_m: windows farther from the camera than this are dark.
    """

    corners_m: Array
    normal: Array
    geom_id: npt.NDArray[np.int32]
    gain: Lights
    light: Lights
    reach_m: float = 1200.0

    def seen(self, geom_id: IdImage, depth_m: FloatImage, camera: CameraRecord) -> npt.NDArray[np.int32]:
        """Returns the index of the lit window that each pixel shows: (H, W) int32, -1 for no window.

        A pixel shows a window if it has the window's geom id and its world position lies in the window's plane. The
        geom id alone is not sufficient, because one geom may contain many houses, and one house may hide another.

        Args:
            geom_id: (H, W) geom ids; -1 for none.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            camera: the camera that takes the picture.
        """
        pose = camera.world_from_camera_transform
        found = np.full(geom_id.shape, -1, np.int32)
        away_m = self.corners_m[:, 0] - pose.translation_m
        near = np.flatnonzero(
            (np.einsum("nd,nd->n", away_m, self.normal) < 0) & (np.linalg.norm(away_m, axis=1) < self.reach_m)
        )
        inside = (self.corners_m[near] - pose.translation_m) @ pose.rotation
        before = (inside[..., 2] > _NEAREST_M).all(axis=1)
        near, inside = near[before], inside[before]
        places_px = _pixels(inside, camera)
        low, high = places_px.min(axis=1), places_px.max(axis=1)
        size = np.array([camera.width_px, camera.height_px])
        shown = ((high > 0) & (low < size) & (high - low > _LEAST_SIDE_PX)).all(axis=1)
        near, inside, places_px = near[shown], inside[shown], places_px[shown]
        points = np.round(np.clip(places_px, -1e4, 1e5) * (1 << _FRACTION_BITS)).astype(np.int32)
        for index in np.argsort(-inside[..., 2].mean(axis=1), kind="stable"):
            cv2.fillConvexPoly(found, points[index], int(near[index]), cv2.LINE_8, _FRACTION_BITS)
        rows, columns = np.nonzero(found >= 0)
        pane = found[rows, columns]
        from_pane_m = world_positions(rows, columns, depth_m, camera) - self.corners_m[pane, 0]
        is_other = self.geom_id[pane] != geom_id[rows, columns]
        is_other |= np.abs(np.einsum("nd,nd->n", from_pane_m, self.normal[pane])) > _OFF_PLANE_M
        found[rows[is_other], columns[is_other]] = -1
        return found


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampGlare:
    """The visible lamps of one kind, each as a spot of light in the picture.

    Attributes:
        position_m: (N, 3) world positions.
        places_px: (N, 2) column and row of each lamp in the picture, index pixels.
        size_px: (N,) radius of the lamp's glass in the picture, pixels.
        strength: (N,) light at the middle of the spot; 1.0 is the frame's full scale.
    """

    position_m: Array
    places_px: Array
    size_px: Array
    strength: Array

    @staticmethod
    def of(lamps: Lamps, camera: CameraRecord, glare: float, depth_m: FloatImage) -> LampGlare:
        """Finds the lamps that are in front of the camera, shine towards it, and are hidden by no surface.

        Args:
            lamps: lamps of one kind.
            camera: the camera that takes the picture.
            glare: light at the middle of a spot per unit of intensity towards the camera.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
        """
        pose = camera.world_from_camera_transform
        inside = (lamps.position_m - pose.translation_m) @ pose.rotation
        share = lamps.shares_towards(pose.translation_m)
        chosen = np.flatnonzero((inside[:, 2] > _NEAREST_LAMP_M) & (share > 0))
        places_px = _pixels(inside[chosen], camera)
        columns, rows = np.round(places_px).astype(np.int64).T
        height, width = depth_m.shape
        is_shown = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        before_m = np.full(len(chosen), np.nan)
        before_m[is_shown] = depth_m[rows[is_shown], columns[is_shown]]
        hidden = before_m < inside[chosen, 2] - _HIDDEN_M
        seen = chosen[~hidden]
        return LampGlare(
            position_m=lamps.position_m[seen],
            places_px=places_px[~hidden],
            size_px=camera.focal_px * _LAMP_RADIUS_M / inside[seen, 2],
            strength=np.minimum(glare * share[seen] * lamps.intensity[seen], _MOST),
        )

    def spots(self, size_px: tuple[int, ...]) -> FloatImage:
        """The spots of all lamps as a picture: (height, width) float32 light, equal for all channels. Each spot is the
        sum of a narrow Gaussian and a wide, faint Gaussian.

        Args:
            size_px: height and width of the picture.
        """
        result = np.zeros(size_px, np.float32)
        for place, size, strength in zip(self.places_px, self.size_px, self.strength, strict=True):
            sigma = max(_LEAST_SIGMA_PX, size)
            # A lamp that is smaller than the smallest spot gets that spot, but darker.
            peak = strength * min(1.0, size / sigma)
            for width, height in ((1.0, peak), (_GLARE_WIDTH, _GLARE_SHARE * peak)):
                _add_spot(result, place, (width * sigma, width * sigma), height)
        return result

    def streaks(self, camera: CameraRecord, ground_m: float) -> FloatImage:
        """The reflections of the lamps on wet ground, as streaks that point to the camera: (H, W) float32 light, equal
        for all channels.

        Args:
            camera: the camera that takes the picture.
            ground_m: height of the level ground in world coordinates.
        """
        pose = camera.world_from_camera_transform
        below_m = self.position_m * (1, 1, -1) + (0, 0, 2 * ground_m)
        places_px = _pixels((below_m - pose.translation_m) @ pose.rotation, camera)
        result = np.zeros((camera.height_px, camera.width_px), np.float32)
        for place, size, strength in zip(places_px, self.size_px, self.strength, strict=True):
            across = max(_LEAST_SIGMA_PX, _STREAK_WIDTH * size)
            along = _STREAK_LENGTH * camera.height_px
            _add_spot(result, place, (across, along), strength * min(1.0, _STREAK_WIDTH * size / across))
        return result


def _pixels(inside: Array, camera: CameraRecord) -> Array:
    """(N, 2) index pixels of (N, 3) points in the camera's frame."""
    pinhole = camera.intrinsics
    return np.asarray(
        inside[..., :2] / inside[..., 2:] * (pinhole.fx_px, pinhole.fy_px) + (pinhole.cx_px, pinhole.cy_px)
    )


def _add_spot(picture: FloatImage, place: Array, sigma: tuple[float, float], peak: float) -> None:
    columns, rows = (
        np.arange(max(0, math.floor(at - _SPOT_REACH * width)), min(size, math.ceil(at + _SPOT_REACH * width) + 1))
        for at, width, size in zip(place, sigma, picture.shape[::-1], strict=True)
    )
    if not len(columns) or not len(rows):
        return
    across, down = (
        np.exp(-np.square((values - at) / width) / 2)
        for values, at, width in zip((columns, rows), place, sigma, strict=True)
    )
    picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] += (peak * down[:, None] * across).astype(np.float32)
