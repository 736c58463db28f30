"""Lamps: positions, intensities, and how their light is distributed over directions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from gear.values.frames import FloatImage
from gear.values.geometry import Array
from gear.values.scene import ActorRecord, SceneRecord

DRIVING = ("ego", "npc", "carrier")
"""Roles of the vehicles whose lamps are switched on."""

HEAD_REACH_M = 70.0
HEAD_HEIGHT_M = 0.65
HEAD_DIP = 0.012
"""Tangent of the angle by which low beams point below the horizontal."""

HEAD_COLOUR = (1.0, 0.93, 0.80)
HEAD_INTENSITY = 130.0
_UPRIGHT = 1e-6
_HEAD_WIDTH, _HEAD_CUT, _HEAD_DEPTH, _HEAD_STRAY = 0.38, 0.012, 0.16, 0.015


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Lamps:
    """N lamps of one kind.

    Attributes:
        position_m: (N, 3) world positions.
        axis: (N, 3) unit vectors along which the lamps shine.
        intensity: (N,) light of a white surface one metre in front of the lamp; 1.0 is the frame's full scale.
        colour: (3,) factors for red, green and blue.
        beam: angular distribution, as a function. Its arguments are the components of unit vectors from the lamp: along
            the axis, horizontally across it, and up. It returns shares of the intensity.
        reach_m: surfaces farther away than this get no light, metres.
        up_m, down_m: surfaces more than this above or below the lamp get no light, metres.
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
        """Returns the share of its intensity that each lamp sends towards a position: an (N,) array.

        Args:
            place_m: (3,) world position, such as the camera's.
        """
        away = place_m - self.position_m
        away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
        across = np.einsum("nd,nd->n", away, sides_of(self.axis))
        along = np.einsum("nd,nd->n", away, self.axis)
        return np.asarray(self.beam(*(part.astype(np.float32) for part in (along, across, away[:, 2]))), np.float64)


def sides_of(axis: Array) -> Array:
    """Returns the (N, 3) horizontal unit vectors that point to the left of axes; 0 for vertical axes.

    Args:
        axis: (N, 3) unit vectors in world coordinates.
    """
    side = np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    return np.asarray(np.where(length > _UPRIGHT, side / np.maximum(length, _UPRIGHT), 0.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Headlamps:
    """Positions of a vehicle's headlamps in the actor frame.

    Attributes:
        front_m: distance ahead of the vehicle's origin, metres.
        half_gauge_m: distance of each of the two headlamps from the middle, metres; 0 for a single headlamp.
    """

    front_m: float
    half_gauge_m: float


def street_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """The angular distribution of a street lamp: more light to the sides than straight down, no light upwards.

    Arguments and result are those of `Lamps.beam`: components of unit vectors from the lamp, and shares of its
    intensity.

    Args:
        along, across, up: components of unit vectors from the lamp, along its axis, to the side and upwards.
    """
    return np.asarray(np.clip(along * 3.5, 0, 1) * (1 + 1.6 * (1 - along * along)))


def globe_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """The angular distribution of a globe lamp: light to all sides, less light upwards.

    Arguments and result are those of `Lamps.beam`: components of unit vectors from the lamp, and shares of its
    intensity.

    Args:
        along, across, up: components of unit vectors from the lamp, along its axis, to the side and upwards.
    """
    return np.asarray(np.clip(1 - 0.9 * up, 0.1, 1), dtype=np.float32)


def low_beam(along: FloatImage, across: FloatImage, up: FloatImage) -> FloatImage:
    """The angular distribution of a car's low beam: wide, with a sharp cut-off just above its brightest direction.

    Arguments and result are those of `Lamps.beam`: components of unit vectors from the lamp, and shares of its
    intensity.

    Args:
        along, across, up: components of unit vectors from the lamp, along its axis, to the side and upwards.
    """
    ahead = np.maximum(along, 1e-3)
    side, rise = across / ahead, up / ahead + np.float32(HEAD_DIP)
    above = np.exp(-np.maximum(rise, 0) / np.float32(_HEAD_CUT))
    below = np.exp(-np.square(np.minimum(rise, 0) / np.float32(_HEAD_DEPTH)))
    wide = np.exp(-np.square(side / np.float32(_HEAD_WIDTH)))
    return np.asarray((along > 0) * (wide * above * below + np.float32(_HEAD_STRAY) * along))


def drivers(record: SceneRecord, vehicles: Mapping[str, Headlamps]) -> list[ActorRecord]:
    """Returns the vehicles of a scene whose lamps are on: those that take part in traffic and have headlamps.

    Args:
        record: the scene, for its actors.
        vehicles: positions of headlamps by asset name; assets that are missing in this mapping have no headlamps.
    """
    return [actor for actor in record.actors if actor.asset in vehicles and actor.role in DRIVING]


def headlamps(record: SceneRecord, vehicles: Mapping[str, Headlamps]) -> Lamps:
    """The headlamps of all vehicles of a scene whose lamps are on.

    Args:
        record: the scene.
        vehicles: positions of headlamps by asset name; assets that are missing in this mapping have no headlamps.
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
