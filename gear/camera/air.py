"""Fog, haze and the veil of distant rain between the camera and the scene, applied to linear frames by depth.

    L' = L T + A (1 - T)

L is the light of a surface and L' the light that reaches the camera. The transmittance T depends on depth; the light A
that the air scatters towards the camera depends on direction. T and A do not depend on the colours of surfaces. Frames
therefore stay linear in every albedo, and a patch changes only the pixels that show the patch.

Depth is sampled at pixel centres. In `film` quality, a pixel on a silhouette mixes the colours of two objects but gets
the fog of the object at its centre. In thick fog, silhouettes of near objects are therefore as hard as in `fast`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
        inside_m = length_m - np.float32(self.from_m)
        cv2.max(inside_m, 0.0, dst=inside_m)
        inside_m *= np.float32(self.per_m)
        if self.thinning_per_m <= 0:
            return inside_m
        rate = np.float32(self.thinning_per_m)
        # Density is not extrapolated below the ground, where a ray to the sky points below the horizon.
        start = rise * np.float32(rate * np.float32(self.from_m))
        start += rate * np.float32(height_m)
        cv2.max(start, 0.0, dst=start)
        fall = rise * inside_m
        fall *= np.float32(rate / np.float32(self.per_m)) if self.per_m > 0 else np.float32(0)
        np.maximum(fall, -start, out=fall)
        cv2.copyTo(np.full_like(fall, _LEAST_FALL), (np.abs(fall) < _LEAST_FALL).view(np.uint8), fall)
        if start.max(initial=0) > _STEEP:
            # The same formula for rays from far above the fog, where exp(-fall) would overflow.
            share = cv2.exp(-start)
            share -= cv2.exp(-(start + fall))
        else:
            share = cv2.exp(-start)
            share *= 1 - cv2.exp(-fall)
        share /= fall
        share *= inside_m
        return np.asarray(share, np.float32)


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
        veiled = np.empty_like(linear_rgb)
        height = len(depth_m)
        glow = self._glow(camera)
        before, share = _between_rows(height, glow.shape[1])
        # Strips of rows that lie between the same two rows of the coarse grid.
        ends = np.append(np.flatnonzero(np.diff(before)) + 1, height).tolist()
        strips = [slice(begin, end) for begin, end in zip([0, *ends], ends, strict=False)]
        for rows, through in self._through(depth_m, camera, strips):
            above = glow[:, before[rows.start]]
            change = glow[:, min(before[rows.start] + 1, glow.shape[1] - 1)] - above
            planes = []
            for channel, colour in enumerate(cv2.split(linear_rgb[rows])):
                own = share[rows, None] * change[channel]
                own += above[channel]
                light = colour.astype(np.float32)
                light -= own
                light *= through[channel]
                light += own
                light += np.float32(0.5)
                planes.append(light.astype(np.uint16))
            cv2.merge(planes, dst=veiled[rows])
        return veiled

    def transmittance(self, depth_m: FloatImage, camera: CameraRecord) -> FloatImage:
        """The transmittance of the air between surface and camera: (H, W, 3) float32, 0..1, the share of a
        surface's
        light that reaches the camera, for each pixel and channel.

        Args:
            depth_m: (H, W) planar depth in metres.
            camera: camera of the frame.
        """
        strips = [slice(top, top + _COARSE_PX) for top in range(0, len(depth_m), _COARSE_PX)]
        return np.concatenate([np.stack(through, axis=-1) for _, through in self._through(depth_m, camera, strips)])

    def _through(
        self, depth_m: FloatImage, camera: CameraRecord, strips: Sequence[slice]
    ) -> Iterator[tuple[slice, list[FloatImage]]]:
        """Yields strips of rows and their transmittance, (h, W) for each channel.

        The arrays of a strip stay in the processor's cache, which takes half the time of whole pictures. OpenCV's
        exponential takes a fifth of the time of NumPy's, and NumPy's masked assignments take as long as ten additions.
        """
        pinhole = camera.intrinsics
        x = ((np.arange(camera.width_px) - pinhole.cx_px) / pinhole.fx_px).astype(np.float32)
        y = ((np.arange(camera.height_px) - pinhole.cy_px) / pinhole.fy_px).astype(np.float32)[:, None]
        up = camera.world_from_camera_transform.rotation[2].astype(np.float32)
        height_m = float(camera.world_from_camera.position_m[2])
        for rows in strips:
            # Length of the ray for each metre of depth, and height gained for each metre of the ray.
            length = cv2.sqrt(x * x + (y[rows] * y[rows] + 1))
            rise = x * up[0] + (y[rows] * up[1] + up[2])
            rise /= length
            length_m = depth_m[rows] * length
            is_seen = length_m == length_m
            cv2.patchNaNs(length_m, SKY_DISTANCE_M)
            tau = np.zeros_like(length_m)
            for fog in self.fogs:
                tau += fog.thickness(length_m, rise, height_m)
            length_m *= is_seen
            yield (
                rows,
                [np.asarray(cv2.exp(length_m * np.float32(-per_m) - tau), np.float32) for per_m in self.clear_per_m],
            )

    def _glow(self, camera: CameraRecord) -> FloatImage:
        """The light of the air, (3, h, W): of each channel, in every column, and in one of `_COARSE_PX` rows.

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
        return np.stack([_enlarged(glow[..., c] * LINEAR_FULL_SCALE, width, rows) for c in range(3)])


def _between_rows(height: int, count: int) -> tuple[npt.NDArray[np.intp], FloatImage]:
    """Where the rows of a picture lie in a grid of fewer rows, for linear interpolation.

    Args:
        height: number of rows of the picture.
        count: number of rows of the grid.

    Returns:
        (height,) index of the grid's row above each row, and (height,) share 0..1 of the grid's row below.
    """
    at = (np.arange(height) + 0.5) * (count / height) - 0.5
    at = np.clip(at, 0, count - 1)
    before = at.astype(np.intp)
    return before, (at - before).astype(np.float32)


def _enlarged(coarse: npt.NDArray[Any], width: int, height: int) -> FloatImage:
    return np.asarray(
        cv2.resize(coarse.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR), np.float32
    )
