"""Computes the light that lamps give to the surfaces in a view."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gear.camera.lamp_shadows import LampShadow
from gear.camera.lamps import Lamps, sides_of
from gear.camera.normals import Strip
from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import CameraRecord

_NEAREST_M = 0.5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LampsInView:
    """The lamps of one kind, each with the part of the picture that it may light.

    Attributes:
        lamps: all N lamps of the kind.
        boxes: (N, 4) for each lamp the columns and rows that it may light: first column, column after the last, first
            row, row after the last; an empty range if the lamp lights no pixel.
        sides: (N, 3) horizontal unit vectors to the left of the lamps' axes.
        origin_m: (3,) world position of the camera.
    """

    lamps: Lamps
    sides: Array
    boxes: npt.NDArray[np.int64]
    origin_m: Array

    @staticmethod
    def of(lamps: Lamps, camera: CameraRecord) -> LampsInView:
        """Finds the part of a camera's picture that each lamp may light.

        Args:
            lamps: all lamps of one kind.
            camera: the camera that takes the picture.
        """
        pose = camera.world_from_camera_transform
        sides = np.array([(x, y) for x in (-1, 1) for y in (-1, 1)]) * lamps.reach_m
        corners = np.array([(*side, z) for side in sides for z in (-lamps.down_m, lamps.up_m)])
        inside = (lamps.position_m[:, None] + corners - pose.translation_m) @ pose.rotation
        size = np.array([camera.width_px, camera.height_px])
        z = inside[..., 2:]
        pinhole = camera.intrinsics
        middle = np.array([pinhole.cx_px, pinhole.cy_px]) + 0.5
        places = inside[..., :2] / np.maximum(z, _NEAREST_M) * (pinhole.fx_px, pinhole.fy_px) + middle
        low, high = np.floor(places.min(axis=1)), np.ceil(places.max(axis=1))
        # A volume that reaches behind the camera may be anywhere in the picture.
        behind = z.min(axis=1) <= _NEAREST_M
        low, high = np.where(behind, 0, low), np.where(behind, size, high)
        high[z.max(axis=(1, 2)) <= 0] = 0
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1).astype(np.int64)
        return LampsInView(lamps=lamps, sides=sides_of(lamps.axis), boxes=boxes, origin_m=pose.translation_m)

    def near(self, within_m: float) -> list[int]:
        """Returns the indices of the lamps that may light part of the picture and are near the camera.

        Args:
            within_m: largest distance from the camera, metres.
        """
        away_m = np.linalg.norm(self.lamps.position_m - self.origin_m, axis=1)
        first, last, above, below = self.boxes.T
        return np.flatnonzero((first < last) & (above < below) & (away_m < within_m)).tolist()

    def light(self, strip: Strip, shadows: Mapping[int, LampShadow] | None = None) -> FloatImage | None:
        """The light of the lamps on white surfaces in a strip of the picture: (h, W) float32, without colour; None if
        no lamp lights the strip.

        Args:
            strip: some rows of the view.
            shadows: shadows of some of the lamps, by the lamp's index; lamps that are missing in this mapping cast no
                shadows.
        """
        top, bottom = strip.rows.start, strip.rows.stop
        first, last, above, below = self.boxes.T
        chosen = np.flatnonzero((above < bottom) & (below > top) & (first < last))
        if not len(chosen):
            return None
        total = np.zeros(strip.normal.shape[1:], np.float32)
        for index in chosen.tolist():
            part = (slice(max(above[index] - top, 0), below[index] - top), slice(first[index], last[index]))
            shadow = shadows.get(index) if shadows else None
            self._add(index, strip.position_m[:, *part], strip.normal[:, *part], total[part], shadow)
        return total

    def _add(
        self, index: int, position_m: FloatImage, normal: FloatImage, total: FloatImage, shadow: LampShadow | None
    ) -> None:
        lamps = self.lamps
        place = (lamps.position_m[index] - self.origin_m).astype(np.float32)
        height = position_m[2] - place[2]
        x, y = position_m[0] - place[0], position_m[1] - place[1]
        square = x * x + y * y + height * height
        if float(square.min()) >= lamps.reach_m**2:
            return
        inverse = 1 / np.sqrt(square + np.float32(1e-4))
        x, y, z = x * inverse, y * inverse, height * inverse
        facing = np.maximum(-(normal[0] * x + normal[1] * y + normal[2] * z), 0)
        axis, side = self.lamps.axis[index].astype(np.float32), self.sides[index].astype(np.float32)
        along, across = axis[0] * x + axis[1] * y + axis[2] * z, side[0] * x + side[1] * y
        ends = np.maximum(1 - np.square(square * np.float32(lamps.reach_m**-2)), 0)
        light = lamps.beam(along, across, z) * facing * np.square(ends * inverse)
        light *= np.float32(lamps.intensity[index])
        if shadow is not None:
            shadow.attenuate(light, (x, y, z), square * inverse, facing, normal[2])
        total += light
