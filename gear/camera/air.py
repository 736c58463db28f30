"""Fog, haze and the veil of distant rain between the camera and the scene, applied to linear frames by depth.

    L' = L T + A (1 - T)

L is the light of a surface and L' the light that reaches the camera. The transmittance T depends on depth; the light A
that the air scatters towards the camera depends on direction. T and A do not depend on the colours of surfaces. Frames
therefore stay linear in every albedo, and a patch changes only the pixels that show the patch.

Depth is sampled at pixel centres. In `film` quality, a pixel on a silhouette mixes the colours of two objects but gets
the fog of the object at its centre. In thick fog, silhouettes of near objects are therefore as hard as in `fast`.
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
"""Length in metres that is assumed for rays that hit nothing (sky). It matters for fog that has the same density at all
heights.
"""

_COARSE_PX = 16
_STRIP_ROWS = 32
_LEAST_FALL = np.float32(3e-4)
_STEEP = 80.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Fog:
    """A fog, or the veil of rain: extinction that starts at a distance from the camera and decreases exponentially with
    height.

    Attributes:
        per_m: extinction coefficient at height 0, 1/m.
        from_m: distance from the camera along a ray at which the fog starts, metres.
        thinning_per_m: rate of the exponential decrease with height, 1/m; 0 for the same fog at all heights.
    """

    per_m: float
    from_m: float
    thinning_per_m: float

    def thickness(self, length_m: FloatImage, rise: FloatImage, height_m: float) -> FloatImage:
        """Optical thickness of the fog along rays: the integral of the extinction, in closed form.

        If the density decreases by the factor exp(-x) between the two ends of a ray, the mean density is (1 - exp(-x))
        / x times the density at the lower end.

        Args:
            length_m: (h, w) lengths of the rays in metres.
            rise: (h, w) height gained per metre of ray.
            height_m: height at which the rays start (the camera's), metres.

        Returns:
            (h, w) float32 optical thickness, without unit.
        """
        inside_m = np.maximum(length_m - np.float32(self.from_m), 0)
        if self.thinning_per_m <= 0:
            return np.asarray(np.float32(self.per_m) * inside_m)
        rate = np.float32(self.thinning_per_m)
        # Density is not extrapolated below the ground, where a ray to the sky points below the horizon.
        start = np.maximum(rate * (np.float32(height_m) + np.float32(self.from_m) * rise), 0)
        fall = np.maximum(rate * rise * inside_m, -start)
        np.copyto(fall, _LEAST_FALL, where=np.abs(fall) < _LEAST_FALL)
        density = np.exp(-start)
        if start.max(initial=0) > _STEEP:
            # The same formula for rays from far above the fog, where exp(-fall) would overflow.
            density = (density - np.exp(-(start + fall))) / fall
        else:
            density *= (1 - np.exp(-fall)) / fall
        return np.asarray(density * inside_m * np.float32(self.per_m))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Air:
    """The air of one weather: how much of a surface's light it takes away, and the light that it scatters to the
    camera.

    Attributes:
        fogs: fog and the veil of rain; their optical thicknesses add up.
        clear_per_m: (3,) extinction coefficient of clear air for red, green and blue, 1/m, the same at every height. It
            does not dim the sky, because the picture of the sky already contains it.
        ring: (N, 3) light of the air by azimuth, counter-clockwise from east; 1.0 is the frame's full scale.
    """

    fogs: tuple[Fog, ...]
    clear_per_m: Array
    ring: Array

    def apply(self, linear_rgb: UInt16Image, depth_m: FloatImage, camera: CameraRecord) -> UInt16Image:
        """Adds fog and haze to a frame.

        Args:
            linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            camera: the camera that takes the picture.

        Returns:
            (H, W, 3) uint16 frame with fog and haze, a new array.
        """
        if not self.fogs and not self.clear_per_m.any():
            return linear_rgb.copy()
        rays, glow = self._directions(camera)
        planes = [np.empty(depth_m.shape, np.uint16) for _ in range(3)]
        colours = cv2.split(linear_rgb)
        # Strips of rows stay in the processor's cache, which takes half the time of whole pictures.
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
        """The transmittance of the air between surface and camera: (H, W, 3) float32, 0..1, the share of a surface's
        light that reaches the camera, for each pixel and channel.
        """
        rays, _ = self._directions(camera)
        return np.stack(self._through(depth_m, rays, float(camera.world_from_camera.position_m[2])), axis=-1)

    def _through(self, depth_m: FloatImage, rays: FloatImage, height_m: float) -> list[FloatImage]:
        """Transmittance, (h, w) per channel.

        Args:
            depth_m: (h, w).
            rays: (2, h, w) length of the ray, and height gained, per metre of depth.
            height_m: height of the camera.
        """
        seen = depth_m == depth_m
        rise = rays[1] / rays[0]
        length_m = np.where(seen, depth_m * rays[0], np.float32(SKY_DISTANCE_M))
        tau = np.zeros_like(length_m)
        for fog in self.fogs:
            tau += fog.thickness(length_m, rise, height_m)
        length_m *= seen
        return [np.exp(length_m * np.float32(-per_m) - tau) for per_m in self.clear_per_m]

    def _directions(self, camera: CameraRecord) -> tuple[FloatImage, list[FloatImage]]:
        """Two values for each pixel: the rays as `_through` takes them, and the light of the air as three (H, W)
        channels.

        The light varies slowly, so it is computed on a coarse grid and interpolated.
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
