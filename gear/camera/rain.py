"""Falling rain: streaks of drops in the picture; objects hide the drops behind them.

    L' = L (1 - a) + D a

The share a of a pixel that drops cover follows from the sample's random generator and from depth. D is the light in a
drop, which is that of the sky. a and D do not depend on any albedo. Frames therefore stay linear, and a sample has the
same drops with and without a patch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
import numpy.typing as npt

from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, UInt16Image
from gear.values.geometry import Array
from gear.values.scene import CameraRecord, Vec3

SHUTTER_S = 1 / 120
"""Exposure time in seconds that gives the streaks their length."""

FALL_MPS = 7.5
DROPS_PER_M3 = 16.0
"""Number of visible drops per cubic metre in the strongest rain."""

DROP_M = 0.0022
_LAYERS_M = (0.8, 2.0, 4.0, 8.0, 14.0)
_WIND_MPS = 6.0
_OPACITY = 0.8
_SHIFT = 4


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rain:
    """The falling rain of one weather.

    Attributes:
        intensity: strength of the rain, 0..1.
        wind_world_mps: horizontal velocity of the drops in world coordinates, m/s.
        light: (3,) light of a drop; 1.0 is the frame's full scale.
    """

    intensity: float
    wind_world_mps: Vec3
    light: Array

    @staticmethod
    def of(precipitation: float, wind_intensity: float, light: Array) -> Rain:
        """Makes the rain for CARLA's weather parameters.

        Args:
            precipitation: strength of the rain, percent.
            wind_intensity: strength of the wind, percent; it blows from the west.
            light: (3,) light of a drop; 1.0 is the frame's full scale.
        """
        wind = (_WIND_MPS * wind_intensity / 100, 0.25 * _WIND_MPS * wind_intensity / 100, 0.0)
        return Rain(intensity=precipitation / 100, wind_world_mps=wind, light=light)

    def apply(
        self,
        linear_rgb: UInt16Image,
        depth_m: FloatImage,
        camera: CameraRecord,
        velocity_world_mps: Vec3,
        rng: np.random.Generator,
    ) -> UInt16Image:
        """Draws streaks of rain into a frame.

        Args:
            linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            camera: the camera that takes the picture.
            velocity_world_mps: velocity of the camera in world coordinates, m/s.
            rng: random generator of this sample and camera.

        Returns:
            (H, W, 3) uint16 frame with streaks, a new array.
        """
        if self.intensity <= 0:
            return linear_rgb.copy()
        cover = self.cover(depth_m, camera, velocity_world_mps, rng)[..., None]
        drop = (np.asarray(self.light) * LINEAR_FULL_SCALE).astype(np.float32)
        return np.asarray(linear_rgb + cover * (drop - linear_rgb) + np.float32(0.5), dtype=np.uint16)

    def cover(
        self, depth_m: FloatImage, camera: CameraRecord, velocity_world_mps: Vec3, rng: np.random.Generator
    ) -> FloatImage:
        """Returns the share of each pixel that falling drops cover: (H, W) float32 in 0..1.

        Args:
            depth_m: (H, W) float32 planar z, NaN where nothing was hit; surfaces hide the drops behind them.
            camera: the camera that takes the picture.
            velocity_world_mps: velocity of the camera in world coordinates, m/s.
            rng: random generator of this sample and camera.
        """
        falling = np.array([*self.wind_world_mps[:2], -FALL_MPS]) - np.asarray(velocity_world_mps)
        motion = camera.world_from_camera_transform.rotation.T @ falling * SHUTTER_S
        clear = np.ones(depth_m.shape, np.float32)
        for near_m, far_m in pairwise(_LAYERS_M):
            layer = self._layer(camera, near_m, far_m, motion, rng)
            # Surfaces nearer than the middle of the layer hide it.
            hidden = depth_m < math.sqrt(near_m * far_m)
            layer[hidden] = 0
            clear *= 1 - layer.astype(np.float32) * np.float32(1 / 255)
        return 1 - clear

    def _layer(
        self, camera: CameraRecord, near_m: float, far_m: float, motion: Array, rng: np.random.Generator
    ) -> npt.NDArray[np.uint8]:
        """(H, W) uint8 share of each pixel that drops between two depths cover; 255 is the whole pixel."""
        pinhole = camera.intrinsics
        half_x, half_y = camera.width_px / (2 * pinhole.fx_px), camera.height_px / (2 * pinhole.fy_px)
        # Tangents of the view's middle: 0 unless the principal point lies elsewhere.
        aside = ((camera.width_px - 1) / 2 - pinhole.cx_px) / pinhole.fx_px
        down = ((camera.height_px - 1) / 2 - pinhole.cy_px) / pinhole.fy_px
        volume = 4 * half_x * half_y * (far_m**3 - near_m**3) / 3
        count = int(rng.poisson(min(volume * DROPS_PER_M3 * self.intensity, 6000)))
        # Uniform in the volume of the view between the two depths.
        depth = np.cbrt(near_m**3 + rng.random(count) * (far_m**3 - near_m**3))
        start = np.column_stack(
            [
                depth * half_x * rng.uniform(-1.1, 1.1, count) + depth * aside,
                depth * half_y * rng.uniform(-1.3, 1.1, count) + depth * down,
                depth,
            ]
        )
        strength = rng.uniform(0.35, 1.0, count)
        end = start + motion
        end[:, 2] = np.maximum(end[:, 2], 0.3)
        ends = [self._pixels(points, camera) for points in (start, end)]
        width_px = camera.focal_px * DROP_M / depth
        length_px = np.linalg.norm(ends[1] - ends[0], axis=1)
        # Longer streaks are fainter, and so are streaks thinner than a pixel.
        smear = np.minimum(1.0, 6 * np.maximum(width_px, 0.5) / np.maximum(length_px, 1.0)) ** 0.5
        opacity = 255 * _OPACITY * strength * np.minimum(width_px, 1.0) * smear
        canvas = np.zeros((camera.height_px, camera.width_px), np.uint8)
        scaled = [np.round(points * (1 << _SHIFT)).astype(np.int32) for points in ends]
        order = np.argsort(opacity, kind="stable")
        for i in order:
            cv2.line(
                canvas,
                (int(scaled[0][i, 0]), int(scaled[0][i, 1])),
                (int(scaled[1][i, 0]), int(scaled[1][i, 1])),
                float(opacity[i]),
                max(1, round(float(width_px[i]))),
                cv2.LINE_AA,
                _SHIFT,
            )
        blur = min(2.0, 0.35 * camera.focal_px * DROP_M / near_m)
        return np.asarray(cv2.GaussianBlur(canvas, (0, 0), blur) if blur > 0.4 else canvas, dtype=np.uint8)

    @staticmethod
    def _pixels(points_m: Array, camera: CameraRecord) -> Array:
        pinhole = camera.intrinsics
        pixels = np.array([pinhole.fx_px, pinhole.fy_px]) * points_m[:, :2] / points_m[:, 2:]
        return np.asarray(np.clip(pixels + np.array([pinhole.cx_px, pinhole.cy_px]), -3e4, 3e4))
