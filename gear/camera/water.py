"""Puddles and wet ground in linear frames, by the semantic label and the position of each pixel.

    L' = L + f (S - L)                        damp ground
    L'' = L' (1 - p) + p (L d (1 - F) + R F)    with puddles on it

p is the share of still water, a fixed random pattern of the town. F is the Fresnel reflectance of water, and d darkens
the bottom of a puddle. f is the reflectance of a film of water on rough ground. R and S are the reflections of the
street in still water and on damp ground (`gear.camera.reflection`), rendered with neutral surfaces. All of these
quantities are independent of patches. Frames therefore stay linear in every albedo, and a patch changes only the pixels
that show the patch.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.fractal import TILE_PX, periodic_noise, sampled, smooth_step
from gear.camera.reflection import Reflection
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord

_Floats = npt.NDArray[np.float32]
_Mask = npt.NDArray[np.bool_]

TILE_M = 96.0
"""Period of the pattern of puddles, metres."""

WATER_F0 = 0.02
BOTTOM = 0.6
FILM_F0, FILM_F90 = 0.03, 0.55
"""Reflectances of damp ground, for a view from above and for a view at a grazing angle. The second is lower than that
of a mirror, because the ground is rough.
"""

LEVEL_M = (0.2, 0.5)
"""Two height differences between ground and mirror, metres. Up to the first, the reflection has full strength; beyond
the second, there is no reflection.
"""

_ALL = 0.999

_OCTAVES = (32, 64, 128, 256)
_SLOPE = 0.9
_EDGE = 0.035
_RIPPLE_TILE_M = 3.0
_RIPPLE_SLOPE = 0.12


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Water:
    """The water on the ground of one town in one weather.

    Attributes:
        town: name of the town, which determines the pattern of puddles.
        share: share of open ground that is under water, 0..1.
        ripples: strength of ripples by falling rain, 0..1.
        film: wetness of the ground between puddles, 0..1.
        mirrored: (rows, columns, 3) float32 light of sky and houses, which is reflected if the street's reflection is
            unknown; 1.0 is the frame's full scale. Rows are sines of the elevation, from level (row 0) to overhead;
            columns are azimuths, counter-clockwise from east.
    """

    town: str
    share: float
    ripples: float
    film: float = 0.0
    mirrored: npt.NDArray[np.float32]

    def apply(
        self,
        linear_rgb: UInt16Image,
        depth_m: FloatImage,
        open_ground: _Mask,
        camera: CameraRecord,
        reflection: Reflection | None = None,
    ) -> UInt16Image:
        """Adds puddles and wet ground to a frame.

        Args:
            linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            open_ground: (H, W) bool, True where a pixel shows ground that may be wet.
            camera: the camera that takes the picture.
            reflection: the reflected street, for ground at the height of its mirror. Ground at other heights, and
                unknown parts of the street, reflect `mirrored`. If None, puddles reflect `mirrored` and there is no
                film.

        Returns:
            (H, W, 3) uint16 frame with water, a new array.
        """
        result = linear_rgb.copy()
        film = self.film if reflection is not None else 0.0
        rows, columns = np.nonzero(open_ground)
        if (self.share <= 0 and film <= 0) or not len(rows):
            return result
        position_m = camera.world_from_camera_transform.translation_m
        towards = _towards(rows, columns, depth_m[rows, columns], camera)
        distance_m = np.sqrt(towards[0] ** 2 + towards[1] ** 2 + towards[2] ** 2)
        sine = np.clip(-towards[2] / distance_m, 0, 1)
        level = np.zeros(len(rows), np.float32)
        if reflection is not None:
            away_m = np.abs(towards[2] + np.float32(position_m[2] - reflection.height_m))
            level = 1 - smooth_step(away_m, LEVEL_M[0], LEVEL_M[1] - LEVEL_M[0])
        seen = linear_rgb[rows, columns].astype(np.float32)
        mixed = seen.copy()
        if reflection is not None and film > 0:
            share = np.float32(film) * _fresnel(sine, FILM_F0, FILM_F90)[:, None]
            soft = self._light(reflection, reflection.soft, towards[0], towards[1], sine * distance_m, level)
            mixed += share * (soft - seen)
        at_px = [(towards[axis] + np.float32(position_m[axis] % TILE_M)) * (TILE_PX / TILE_M) for axis in (0, 1)]
        water = smooth_step(sampled(_pattern(self.town), *at_px), 1 - self.share, _EDGE)
        wet = np.flatnonzero(water > 0)
        if len(wet):
            sine = self._stirred(sine[wet], distance_m[wet], [axis[wet] for axis in at_px])
            up = sine * distance_m[wet]
            sharp = None if reflection is None else reflection.sharp
            light = self._light(reflection, sharp, towards[0][wet], towards[1][wet], up, level[wet])
            mirror = _fresnel(sine, WATER_F0, 1.0)[:, None]
            under = seen[wet] * BOTTOM * (1 - mirror) + light * mirror
            mixed[wet] += water[wet, None] * (under - mixed[wet])
        result[rows, columns] = np.minimum(mixed + 0.5, LINEAR_FULL_SCALE).astype(np.uint16)
        return result

    def _light(
        self,
        reflection: Reflection | None,
        picture: _Floats | None,
        east: _Floats,
        north: _Floats,
        up: _Floats,
        level: _Floats,
    ) -> _Floats:
        """(N, 3) reflected light in units of the frame: that of the street where it is known, otherwise that of
        `mirrored`.

        Args:
            reflection: the reflected street, or None.
            picture: its sharp or soft picture.
            east, north, up: (N,) components of the directions, which may have any length.
            level: (N,) share of the street's reflection that the ground's height leaves, 0..1.
        """
        full = np.float32(LINEAR_FULL_SCALE)
        if reflection is None or picture is None:
            return self._sky(east, north, up) * full
        found = reflection.at(picture, east, north, up) * level[:, None]
        light, known = found[:, :3], found[:, 3]
        missing = np.flatnonzero(known < _ALL)
        light[missing] += (1 - known[missing, None]) * self._sky(east[missing], north[missing], up[missing])
        return np.asarray(light * full, dtype=np.float32)

    def _sky(self, east: _Floats, north: _Floats, up: _Floats) -> _Floats:
        """(N, 3) light of `mirrored` in directions (N,) of any length."""
        if not len(east):
            return np.zeros((0, 3), np.float32)
        rows, columns = self.mirrored.shape[:2]
        sine = up / np.sqrt(east * east + north * north + up * up)
        # Slightly below the last row, so that the zenith does not wrap around to the horizon.
        row = np.minimum(sine * (rows - 1), np.float32(rows - 1.001))
        azimuth_rad = cv2.phase(east, north).reshape(-1)
        return sampled(self.mirrored, azimuth_rad * np.float32(columns / (2 * np.pi)), row)

    def _stirred(self, sine: _Floats, distance_m: _Floats, at_px: list[_Floats]) -> _Floats:
        """(N,) sines of the elevations of the reflected rays, perturbed by ripples."""
        if self.ripples <= 0:
            return sine
        scale = TILE_M / _RIPPLE_TILE_M
        # Ripples smaller than a pixel average out.
        slope = _RIPPLE_SLOPE * self.ripples / (1 + distance_m / 6)
        ripple = sampled(_pattern("ripples"), at_px[0] * scale, at_px[1] * scale) - np.float32(0.5)
        return np.asarray(np.minimum(np.abs(sine + 2 * slope * ripple), 1), dtype=np.float32)


def _fresnel(sine: _Floats, above: float, grazing: float) -> _Floats:
    """(N,) reflectance from the sine of elevation, by Schlick's approximation (1994) of Fresnel's formula.

    Args:
        sine: (N,) sines of the elevation.
        above: reflectance seen from straight above.
        grazing: reflectance at a grazing angle.
    """
    flat = (1 - sine) ** 2
    return np.asarray(above + (grazing - above) * flat * flat * (1 - sine), dtype=np.float32)


def _towards(
    rows: npt.NDArray[np.intp], columns: npt.NDArray[np.intp], depth_m: _Floats, camera: CameraRecord
) -> list[_Floats]:
    """Vectors from the camera to the surfaces of N pixels, in metres, as three (N,) arrays: east, north and up."""
    pinhole = camera.intrinsics
    x = (columns.astype(np.float32) - np.float32(pinhole.cx_px)) * depth_m * np.float32(1 / pinhole.fx_px)
    y = (rows.astype(np.float32) - np.float32(pinhole.cy_px)) * depth_m * np.float32(1 / pinhole.fy_px)
    rotation = camera.world_from_camera_transform.rotation.astype(np.float32)
    return [row[0] * x + row[1] * y + row[2] * depth_m for row in rotation]


@cache
def _pattern(town: str) -> npt.NDArray[np.float32]:
    """(`TILE_PX`, `TILE_PX`) fractal texture of a town; the same in every process."""
    return periodic_noise(derive_rng(0, "puddles", town), _OCTAVES, _SLOPE)
