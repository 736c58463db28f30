"""What glows by itself: windows with light behind them, and lamps that shine at the camera."""

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
    """Panes with light behind them.

    Attributes:
        corners_m: (N, 4, 3) in the world, in order around each pane.
        normal: (N, 3) unit vectors out of the house.
        geom_id: (N,) of the geom that each is part of.
        gain: (N, 3) how often the frame's own light a pane shows: curtains and goods in lamplight.
        light: (N, 3) that a pane shows besides, in shares of full scale.
        reach_m: panes farther away are left dark.
    """

    corners_m: Array
    normal: Array
    geom_id: npt.NDArray[np.int32]
    gain: Lights
    light: Lights
    reach_m: float = 1200.0

    def seen(self, geom_id: IdImage, depth_m: FloatImage, camera: CameraRecord) -> npt.NDArray[np.int32]:
        """(H, W) number of the pane that each pixel shows, -1 for none: it is of the pane's geom, and in its plane.

        One geom may be many houses, of which one stands before another.
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
    """Lamps of one kind that shine at a camera.

    Attributes:
        position_m: (N, 3) in the world.
        places_px: (N, 2) column and row, in index pixels.
        size_px: (N,) of the lamp's glass.
        strength: (N,) light of a spot.
    """

    position_m: Array
    places_px: Array
    size_px: Array
    strength: Array

    @staticmethod
    def of(lamps: Lamps, camera: CameraRecord, glare: float, depth_m: FloatImage) -> LampGlare:
        """Those before the camera that nothing in the picture hides.

        Args:
            lamps: of one kind.
            camera: the camera that takes the picture.
            glare: light of a spot per intensity towards the camera.
            depth_m: (H, W) planar z, NaN where nothing is.
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
        """(height, width) light, but for its colour: a spot a lamp, and a little glare about it."""
        result = np.zeros(size_px, np.float32)
        for place, size, strength in zip(self.places_px, self.size_px, self.strength, strict=True):
            sigma = max(_LEAST_SIGMA_PX, size)
            # A lamp smaller than the least spot is as much darker.
            peak = strength * min(1.0, size / sigma)
            for width, height in ((1.0, peak), (_GLARE_WIDTH, _GLARE_SHARE * peak)):
                _add_spot(result, place, (width * sigma, width * sigma), height)
        return result

    def streaks(self, camera: CameraRecord, ground_m: float) -> FloatImage:
        """(H, W) light, but for its colour, on wet level ground at a height: its unevenness draws the images of lamps
        out, towards who looks."""
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
    """(N, 2) index pixels of (N, 3) places in the camera's frame; the middle of the first pixel is (0, 0)."""
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
