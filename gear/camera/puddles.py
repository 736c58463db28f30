"""Puddles: still water on open ground, laid over linear frames by what each pixel shows and where that lies.

    L' = L (1 - p) + p (L d (1 - F) + R F)

p, the share of water, is noise fixed to the town; F is Fresnel's share of light that water mirrors at this angle; R is
the sky that it mirrors, without what stands on the ground; d darkens the bottom. None of these depends on any albedo,
so frames stay linear, and a patch is not seen in puddles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from gear.camera.noise import TILE_PX, periodic_noise, sampled
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.geometry import Array
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord

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
        mirrored: (rows, columns, 3) float32, light by elevation (row 0 is level, the last one overhead) and azimuth
            (column 0 is east, counter-clockwise); 1.0 is the frame's full scale.
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
        depth = depth_m[rows, columns].astype(np.float64)
        pose = camera.world_from_camera_transform
        pixels = np.column_stack([columns, rows]).astype(np.float64)
        towards = camera.intrinsics.unproject(pixels, depth) @ pose.rotation.T
        at_m = (towards[:, :2] + pose.translation_m[:2]) * (TILE_PX / TILE_M)
        water = _smooth(sampled(_pattern(self.town), at_m[:, 0], at_m[:, 1]), 1 - self.share, _EDGE)
        wet = water > 0
        rows, columns, towards, at_m = rows[wet], columns[wet], towards[wet], at_m[wet]
        water = water[wet, None]
        distance_m = np.linalg.norm(towards, axis=1)
        sine = np.clip(-towards[:, 2] / distance_m, 0.0, 1.0)
        elevation, azimuth = self._reflected(towards, sine, at_m, distance_m)
        mirror = (WATER_F0 + (1 - WATER_F0) * (1 - np.sin(elevation)) ** 5)[:, None]
        light = self._light(elevation, azimuth) * LINEAR_FULL_SCALE
        below = linear_rgb[rows, columns].astype(np.float32)
        under = below * BOTTOM * (1 - mirror) + light * mirror
        mixed = below + water * (under - below)
        result[rows, columns] = np.minimum(mixed + 0.5, LINEAR_FULL_SCALE).astype(np.uint16)
        return result

    def _reflected(self, towards: Array, sine: Array, at_px: Array, distance_m: Array) -> tuple[Array, Array]:
        """Elevation and azimuth, in radians, of what (N, 3) rays see in the water."""
        elevation = np.arcsin(sine)
        azimuth = np.arctan2(towards[:, 1], towards[:, 0])
        if self.ripples > 0:
            scale = TILE_M / _RIPPLE_TILE_M
            # Ripples that are smaller than a pixel cancel out.
            slope = _RIPPLE_SLOPE * self.ripples / (1 + distance_m / 6)
            stirred = sampled(_pattern("ripples"), at_px[:, 0] * scale, at_px[:, 1] * scale) - 0.5
            elevation = np.abs(elevation + 2 * slope * stirred)
        return elevation, azimuth

    def _light(self, elevation: Array, azimuth: Array) -> npt.NDArray[np.float32]:
        rows, columns = self.mirrored.shape[:2]
        # The last row stands one below the border, so that the zenith does not wrap around to the horizon.
        row = np.clip(elevation / (np.pi / 2), 0, 1) * (rows - 1)
        return sampled(self.mirrored, azimuth / (2 * np.pi) * columns, np.minimum(row, rows - 1.001))


@cache
def _pattern(town: str) -> npt.NDArray[np.float32]:
    """(`TILE_PX`, `TILE_PX`) noise that belongs to a town."""
    return periodic_noise(derive_rng(0, "puddles", town), _OCTAVES, _SLOPE)


def _smooth(value: npt.NDArray[np.float32], edge: float, width: float) -> npt.NDArray[np.float32]:
    t = np.clip((value - edge) / width, 0, 1)
    return np.asarray(t * t * (3 - 2 * t), dtype=np.float32)
