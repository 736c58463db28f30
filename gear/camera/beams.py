"""Lamps, and the light that they throw on what a camera sees."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gear.camera.slant import Strip
from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import ActorRecord, CameraRecord, SceneRecord

Vectors = npt.NDArray[np.float32]

DRIVING = ("ego", "npc", "carrier")
"""Roles of vehicles whose lamps are on."""

HEAD_REACH_M = 70.0
HEAD_HEIGHT_M = 0.65
HEAD_DIP = 0.012
"""Tangent by which low beams point down."""

HEAD_COLOUR = (1.0, 0.93, 0.80)
HEAD_INTENSITY = 130.0
_NEAREST_M, _UPRIGHT = 0.5, 1e-6
_HEAD_WIDTH, _HEAD_CUT, _HEAD_DEPTH, _HEAD_STRAY = 0.38, 0.012, 0.16, 0.015


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lamps:
    """Some lamps of one kind.

    Attributes:
        position_m: (N, 3) in the world.
        axis: (N, 3) unit vectors along which they shine.
        intensity: (N,) light, times a square metre, that a white surface a metre before the lamp would show.
        colour: (3,) by which it is multiplied.
        beam: how light is spread: from the direction to what is lit, as (along the axis, level across, up) parts of
            a unit vector, to shares of the intensity.
        reach_m: beyond it nothing is lit.
        up_m, down_m: how much higher and lower than a lamp things are lit.
    """

    position_m: Array
    axis: Array
    intensity: Array
    colour: tuple[float, float, float]
    beam: Callable[[FloatImage, FloatImage, FloatImage], FloatImage]
    reach_m: float
    up_m: float
    down_m: float

    def shares_towards(self, place_m: Array) -> Array:
        """(N,) shares of their intensity that lamps send to a place."""
        away = place_m - self.position_m
        away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
        across = np.einsum("nd,nd->n", away, _sides(self.axis))
        along = np.einsum("nd,nd->n", away, self.axis)
        return np.asarray(self.beam(*(part.astype(np.float32) for part in (along, across, away[:, 2]))), np.float64)


def _sides(axis: Array) -> Array:
    """(N, 3) level unit vectors to the left of axes; zero for upright ones."""
    side = np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    return np.asarray(np.where(length > _UPRIGHT, side / np.maximum(length, _UPRIGHT), 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Headlamps:
    """Where a vehicle bears them.

    Attributes:
        front_m: how far ahead of its origin.
        half_gauge_m: from its middle to each of the two; 0 for a single one.
    """

    front_m: float
    half_gauge_m: float


def street_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """A lantern that lights a long piece of its street: more to the sides than straight down, nothing above."""
    return np.asarray(np.clip(along * 3.5, 0, 1) * (1 + 1.6 * (1 - along * along)))


def globe_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """A glass that shines to all sides, under a lid."""
    return np.asarray(np.clip(1 - 0.9 * up, 0.1, 1), dtype=np.float32)


def low_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """A dipped headlamp: wide, bright just below a sharp edge at the height of the lamp."""
    ahead = np.maximum(along, 1e-3)
    side, rise = across / ahead, up / ahead + np.float32(HEAD_DIP)
    above = np.exp(-np.maximum(rise, 0) / np.float32(_HEAD_CUT))
    below = np.exp(-np.square(np.minimum(rise, 0) / np.float32(_HEAD_DEPTH)))
    wide = np.exp(-np.square(side / np.float32(_HEAD_WIDTH)))
    return np.asarray((along > 0) * (wide * above * below + np.float32(_HEAD_STRAY) * along))


def drivers(record: SceneRecord, vehicles: Mapping[str, Headlamps]) -> list[ActorRecord]:
    """Those of a scene that drive, and so with their lamps on."""
    return [actor for actor in record.actors if actor.asset in vehicles and actor.role in DRIVING]


def headlamps(record: SceneRecord, vehicles: Mapping[str, Headlamps]) -> Lamps:
    """The headlamps of all that drive in a scene.

    Args:
        record: the scene.
        vehicles: where each asset bears its own; what is not in it has none.
    """
    positions, axes = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for actor in drivers(record, vehicles):
        found = vehicles[actor.asset]
        pose = actor.world_from_actor.transform("world", "actor")
        sides = (-1, 1) if found.half_gauge_m else (0,)
        own = np.array([(found.front_m, side * found.half_gauge_m, HEAD_HEIGHT_M) for side in sides])
        positions.append(own @ pose.rotation.T + pose.translation_m)
        axes.append(np.tile(pose.rotation[:, 0], (len(sides), 1)))
    count = sum(map(len, positions))
    return Lamps(
        position_m=np.concatenate(positions),
        axis=np.concatenate(axes),
        intensity=np.full(count, HEAD_INTENSITY),
        colour=HEAD_COLOUR,
        beam=low_beam,
        reach_m=HEAD_REACH_M,
        up_m=4.0,
        down_m=4.0,
    )


class Shadow(Protocol):
    """What stops some of a lamp's light."""

    def lay(
        self,
        light: FloatImage,
        towards: tuple[FloatImage, FloatImage, FloatImage],
        away_m: FloatImage,
        facing: FloatImage,
        up: FloatImage,
    ) -> None:
        """As `gear.camera.lamp_shadows.LampShadow.lay` says."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Spots:
    """The lamps of one kind that light something in a picture.

    Attributes:
        lamps: all of the kind.
        boxes: (N, 4) first and last column, first and last row of what each may light; empty boxes for none of it.
        sides: (N, 3) level unit vectors to the left of their axes.
        origin_m: (3,) the camera.
    """

    lamps: Lamps
    sides: Array
    boxes: npt.NDArray[np.int64]
    origin_m: Array

    @staticmethod
    def of(lamps: Lamps, camera: CameraRecord) -> Spots:
        """Those within a camera's view."""
        pose = camera.world_from_camera_transform
        sides = np.array([(x, y) for x in (-1, 1) for y in (-1, 1)]) * lamps.reach_m
        corners = np.array([(*side, z) for side in sides for z in (-lamps.down_m, lamps.up_m)])
        inside = (lamps.position_m[:, None] + corners - pose.translation_m) @ pose.rotation
        size = np.array([camera.width_px, camera.height_px])
        z = inside[..., 2:]
        places = inside[..., :2] / np.maximum(z, _NEAREST_M) * camera.focal_px + size / 2
        low, high = np.floor(places.min(axis=1)), np.ceil(places.max(axis=1))
        # What reaches behind the camera may be anywhere in the picture.
        behind = z.min(axis=1) <= _NEAREST_M
        low, high = np.where(behind, 0, low), np.where(behind, size, high)
        high[z.max(axis=(1, 2)) <= 0] = 0
        low, high = np.clip(low, 0, size), np.clip(high, 0, size)
        boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1).astype(np.int64)
        return Spots(lamps=lamps, sides=_sides(lamps.axis), boxes=boxes, origin_m=pose.translation_m)

    def near(self, within_m: float) -> list[int]:
        """Those that may light something in the picture and are within a distance of the camera."""
        away_m = np.linalg.norm(self.lamps.position_m - self.origin_m, axis=1)
        first, last, above, below = self.boxes.T
        return np.flatnonzero((first < last) & (above < below) & (away_m < within_m)).tolist()

    def light(self, strip: Strip, shadows: Mapping[int, Shadow] | None = None) -> FloatImage | None:
        """(h, W) of what white surfaces would show of the lamps' light, but for its colour; None for darkness.

        Args:
            strip: of the picture.
            shadows: what stops the light of some lamps, by their number.
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
        self, index: int, position_m: FloatImage, normal: FloatImage, total: FloatImage, shadow: Shadow | None
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
            shadow.lay(light, (x, y, z), square * inverse, facing, normal[2])
        total += light
