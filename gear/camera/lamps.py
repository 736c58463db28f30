"""Lamps, and how their light is spread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import ActorRecord, SceneRecord

DRIVING = ("ego", "npc", "carrier")
"""Roles of vehicles whose lamps are on."""

HEAD_REACH_M = 70.0
HEAD_HEIGHT_M = 0.65
HEAD_DIP = 0.012
"""Tangent by which low beams point down."""

HEAD_COLOUR = (1.0, 0.93, 0.80)
HEAD_INTENSITY = 130.0
_UPRIGHT = 1e-6
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
        across = np.einsum("nd,nd->n", away, sides_of(self.axis))
        along = np.einsum("nd,nd->n", away, self.axis)
        return np.asarray(self.beam(*(part.astype(np.float32) for part in (along, across, away[:, 2]))), np.float64)


def sides_of(axis: Array) -> Array:
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
