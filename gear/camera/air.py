"""The air between the camera and what it sees: fog, haze and the veil of rain, laid over linear frames by depth.

    L' = L T + A (1 - T)

T, the share of light that comes through, follows from depth alone, and A, the light of the air itself, from the
direction alone: frames stay linear in every albedo, and a patch changes no pixel that it does not reach.

Depth is sampled at pixel centres. In `film` a pixel on a silhouette has colour from both sides of it, and the air of
the side that its centre sees: between something near and a thick fog the silhouette is as hard as in `fast`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

SKY_DISTANCE_M = 2e4
"""How far fog reaches below the sky, where it does not thin with height."""

_COARSE_PX = 16
_STRIP_ROWS = 32
_LEAST_FALL = np.float32(3e-4)
_STEEP = 80.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Fog:
    """Drops in the air: a fog, or the veil of rain.

    Attributes:
        per_m: extinction at height 0.
        from_m: where it begins, along a ray.
        thinning_per_m: rate at which it thins with height; 0 for a fog without a top.
    """

    per_m: float
    from_m: float
    thinning_per_m: float

    def thickness(self, length_m: FloatImage, rise: FloatImage, height_m: float) -> FloatImage:
        """Optical thickness along rays: the integral of exp(-k height), solved.

        Between two heights a density that falls exponentially adds up to (1 - exp(-x)) / x of what it is at the
        lower end, x being the fall.

        Args:
            length_m: (h, w) of the rays.
            rise: (h, w) how they climb, a metre of ray.
            height_m: of where they begin.
        """
        inside_m = np.maximum(length_m - np.float32(self.from_m), 0)
        if self.thinning_per_m <= 0:
            return np.asarray(np.float32(self.per_m) * inside_m)
        rate = np.float32(self.thinning_per_m)
        # Nothing is denser than the fog on the ground, also where a sky is seen below the horizon.
        start = np.maximum(rate * (np.float32(height_m) + np.float32(self.from_m) * rise), 0)
        fall = np.maximum(rate * rise * inside_m, -start)
        np.copyto(fall, _LEAST_FALL, where=np.abs(fall) < _LEAST_FALL)
        density = np.exp(-start)
        if start.max(initial=0) > _STEEP:
            # The same, where looking down from so high over the fog exp(-fall) is more than a float holds.
            density = (density - np.exp(-(start + fall))) / fall
        else:
            density *= (1 - np.exp(-fall)) / fall
        return np.asarray(density * inside_m * np.float32(self.per_m))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Air:
    """What the air does to light.

    Attributes:
        fogs: what floats in it; each thins, begins and takes its share by itself.
        clear_per_m: (3,) extinction of the air itself, by channel, the same at every height. It dims no sky, which the
            sky's picture has in it.
        ring: (N, 3) light of the air by azimuth, counter-clockwise from east; 1.0 is the frame's full scale.
    """

    fogs: tuple[Fog, ...]
    clear_per_m: Array
    ring: Array

    def apply(self, linear_rgb: UInt16Image, depth_m: FloatImage, camera: CameraRecord) -> UInt16Image:
        """The frame seen through the air.

        Args:
            linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
            depth_m: (H, W) float32 planar z, NaN where nothing is.
            camera: the camera that takes the picture.

        Returns:
            (H, W, 3) uint16, a new array, rounded.
        """
        if not self.fogs and not self.clear_per_m.any():
            return linear_rgb.copy()
        rays, glow = self._directions(camera)
        planes = [np.empty(depth_m.shape, np.uint16) for _ in range(3)]
        colours = cv2.split(linear_rgb)
        # Strips stay in the processor's cache: half the time of whole pictures.
        for top in range(0, len(depth_m), _STRIP_ROWS):
            rows = slice(top, top + _STRIP_ROWS)
            through = self._through(depth_m[rows], rays[:, rows], float(camera.world_from_camera.position_m[2]))
            for channel, plane in enumerate(planes):
                own = glow[channel][rows]
                light = colours[channel][rows].astype(np.float32)
                light -= own
                light *= through[channel]
                light += own
                light += np.float32(0.5)
                plane[rows] = light
        return np.asarray(cv2.merge(planes), dtype=np.uint16)

    def transmittance(self, depth_m: FloatImage, camera: CameraRecord) -> FloatImage:
        """T of each pixel and channel, (H, W, 3) float32 in 0..1."""
        rays, _ = self._directions(camera)
        return np.stack(self._through(depth_m, rays, float(camera.world_from_camera.position_m[2])), axis=-1)

    def _through(self, depth_m: FloatImage, rays: FloatImage, height_m: float) -> list[FloatImage]:
        """(h, w) a channel for (h, w) depth and (2, h, w) rays: their length, and how they climb, a metre of depth."""
        seen = depth_m == depth_m
        rise = rays[1] / rays[0]
        length_m = np.where(seen, depth_m * rays[0], np.float32(SKY_DISTANCE_M))
        tau = np.zeros_like(length_m)
        for fog in self.fogs:
            tau += fog.thickness(length_m, rise, height_m)
        length_m *= seen
        return [np.exp(length_m * np.float32(-per_m) - tau) for per_m in self.clear_per_m]

    def _directions(self, camera: CameraRecord) -> tuple[FloatImage, list[FloatImage]]:
        """(2, H, W) metres of ray and of climb a metre of depth, and (H, W) light of the air a channel.

        The light changes slowly, so it is worked out on a coarse grid.
        """
        width, height = camera.width_px, camera.height_px
        columns, rows = -(-width // _COARSE_PX), -(-height // _COARSE_PX)
        pinhole = camera.intrinsics
        x, y = np.meshgrid(
            (((np.arange(columns) + 0.5) * width / columns) - (pinhole.cx_px + 0.5)) / pinhole.fx_px,
            (((np.arange(rows) + 0.5) * height / rows) - (pinhole.cy_px + 0.5)) / pinhole.fy_px,
        )
        towards = np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.world_from_camera_transform.rotation.T
        azimuth = np.arctan2(towards[..., 1], towards[..., 0]) / (2 * np.pi) * len(self.ring)
        before = np.floor(azimuth).astype(np.int64)
        share = (azimuth - before)[..., None]
        ring = np.asarray(self.ring)
        glow = (1 - share) * ring[before % len(ring)] + share * ring[(before + 1) % len(ring)]
        return self._exact_rays(camera), [_enlarged(glow[..., c] * LINEAR_FULL_SCALE, width, height) for c in range(3)]

    @staticmethod
    def _exact_rays(camera: CameraRecord) -> FloatImage:
        pinhole = camera.intrinsics
        x = ((np.arange(camera.width_px) - pinhole.cx_px) / pinhole.fx_px).astype(np.float32)
        y = ((np.arange(camera.height_px) - pinhole.cy_px) / pinhole.fy_px).astype(np.float32)[:, None]
        up = camera.world_from_camera_transform.rotation[2].astype(np.float32)
        rays = np.empty((2, camera.height_px, camera.width_px), np.float32)
        np.sqrt(x * x + (y * y + 1), out=rays[0])
        np.add(x * up[0], y * up[1] + up[2], out=rays[1])
        return rays


def _enlarged(coarse: npt.NDArray[Any], width: int, height: int) -> FloatImage:
    return np.asarray(
        cv2.resize(coarse.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR), np.float32
    )
