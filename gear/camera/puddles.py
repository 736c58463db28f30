"""Puddles: still water on open ground, laid over linear frames by what each pixel shows and where that lies.

    L' = L (1 - p) + p (L d (1 - F) + R F)

p, the share of water, is noise fixed to the town; F is Fresnel's share of light that water mirrors at this angle; R is
the sky that it mirrors, without what stands on the ground; d darkens the bottom. None of these depends on any albedo,
so frames stay linear, and a patch is not seen in puddles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.noise import TILE_PX, periodic_noise, sampled, smooth_step
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord

_Floats = npt.NDArray[np.float32]

TILE_M = 96.0
"""The pattern of a town's puddles comes back after so many metres."""

WATER_F0 = 0.02
BOTTOM = 0.6
_OCTAVES = (32, 64, 128, 256)
_SLOPE = 0.9
_EDGE = 0.035
_RIPPLE_TILE_M = 3.0
_RIPPLE_SLOPE = 0.12


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Puddles:
    """Standing water of one weather in one town.

    Attributes:
        town: whose pattern it is.
        share: of open ground that lies under water, 0..1.
        ripples: how much falling rain stirs it, 0..1.
        mirrored: (rows, columns, 3) float32, light by the sine of its height (row 0 is level, the last one
            overhead) and azimuth (column 0 is east, counter-clockwise); 1.0 is the frame's full scale.
    """

    town: str
    share: float
    ripples: float
    mirrored: npt.NDArray[np.float32]

    def lay(
        self, linear_rgb: UInt16Image, depth_m: FloatImage, open_ground: npt.NDArray[np.bool_], camera: CameraRecord
    ) -> UInt16Image:
        """The frame with puddles.

        Args:
            linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
            depth_m: (H, W) float32 planar z, NaN where nothing is.
            open_ground: (H, W) where water may stand.
            camera: who looks.

        Returns:
            (H, W, 3) uint16, a new array, rounded.
        """
        result = linear_rgb.copy()
        rows, columns = np.nonzero(open_ground)
        if self.share <= 0 or not len(rows):
            return result
        position_m = camera.world_from_camera_transform.translation_m
        towards = _towards(rows, columns, depth_m[rows, columns], camera)
        at_px = [(towards[axis] + np.float32(position_m[axis] % TILE_M)) * (TILE_PX / TILE_M) for axis in (0, 1)]
        water = smooth_step(sampled(_pattern(self.town), *at_px), 1 - self.share, _EDGE)
        wet = np.flatnonzero(water > 0)
        if not len(wet):
            return result
        rows, columns, water = rows[wet], columns[wet], water[wet, None]
        east, north, up = (axis[wet] for axis in towards)
        distance_m = np.sqrt(east * east + north * north + up * up)
        sine = self._stirred(np.clip(-up / distance_m, 0, 1), distance_m, [axis[wet] for axis in at_px])
        flat = (1 - sine) ** 2
        mirror = (WATER_F0 + (1 - WATER_F0) * flat * flat * (1 - sine))[:, None]
        light = self._light(sine, cv2.phase(east, north).reshape(-1)) * np.float32(LINEAR_FULL_SCALE)
        below = linear_rgb[rows, columns].astype(np.float32)
        under = below * BOTTOM * (1 - mirror) + light * mirror
        mixed = below + water * (under - below)
        result[rows, columns] = np.minimum(mixed + 0.5, LINEAR_FULL_SCALE).astype(np.uint16)
        return result

    def _stirred(self, sine: _Floats, distance_m: _Floats, at_px: list[_Floats]) -> _Floats:
        """(N,) sines of the heights that rays see in the water, moved by ripples."""
        if self.ripples <= 0:
            return sine
        scale = TILE_M / _RIPPLE_TILE_M
        # Ripples that are smaller than a pixel cancel out.
        slope = _RIPPLE_SLOPE * self.ripples / (1 + distance_m / 6)
        ripple = sampled(_pattern("ripples"), at_px[0] * scale, at_px[1] * scale) - np.float32(0.5)
        return np.asarray(np.minimum(np.abs(sine + 2 * slope * ripple), 1), dtype=np.float32)

    def _light(self, sine: _Floats, azimuth_rad: _Floats) -> _Floats:
        rows, columns = self.mirrored.shape[:2]
        # A little below the last row, so that the zenith does not wrap around to the horizon.
        row = np.minimum(sine * (rows - 1), np.float32(rows - 1.001))
        return sampled(self.mirrored, azimuth_rad * np.float32(columns / (2 * np.pi)), row)


def _towards(
    rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp], depth_m: _Floats, camera: CameraRecord
) -> list[_Floats]:
    """East, north and up, (N,) each in metres, from the camera to what pixels show."""
    x = (columns.astype(np.float32) - np.float32((camera.width_px - 1) / 2)) * depth_m * np.float32(1 / camera.focal_px)
    y = (rows.astype(np.float32) - np.float32((camera.height_px - 1) / 2)) * depth_m * np.float32(1 / camera.focal_px)
    rotation = camera.world_from_camera_transform.rotation.astype(np.float32)
    return [row[0] * x + row[1] * y + row[2] * depth_m for row in rotation]


@cache
def _pattern(town: str) -> npt.NDArray[np.float32]:
    """(`TILE_PX`, `TILE_PX`) noise that belongs to a town."""
    return periodic_noise(derive_rng(0, "puddles", town), _OCTAVES, _SLOPE)
